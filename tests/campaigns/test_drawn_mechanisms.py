"""Branches of random mechanisms: a fixed sample of the campaign ``mechanisms``."""

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

import chasles
from chasles.derive import DescriptionError, derive, mobility, write
from chasles.derive.loops.functions.maps import makers
from chasles.derive.model.placements import Translation
from tests.campaigns.mechanisms import FAULTS, Verdict, _compare, half_distance
from tests.support.generators.drawn_mechanisms import FAMILIES, drawn_mechanism
from tests.support.loops.solved import solved
from tests.support.oracles.multi_start import Multistart

INPUTS = 3
FIRST = 520
"""Random seed of the four-bar linkage, the first of the mechanism families. Family k of the list
`FAMILIES` has the random seed `FIRST` + k."""
SAMPLE = ("Watt", "slider-crank", "boom", "palletizer", "RSUR")
"""Tested mechanism families: a six-bar linkage, an actuated slider, cylinders, parallelograms and a
spatial loop."""
MAPS = (
    *("chain", "passive", "configuration", "margin", "chain_all"),
    *("actuators", "actuator_margin", "actuators_all"),
)
"""Functions that map between actuators and joints through the loops."""
C_ALONE = ("c", "python")
OFFSETS = np.array([[-1e-3], [1e-3]])


@pytest.mark.parametrize("family", SAMPLE)
def test_mechanism_branches_match_multi_start_newton(family, tmp_path):
    number = FIRST + list(FAMILIES).index(family)
    drawn = drawn_mechanism(number)
    assert drawn.family == family
    verdict = Verdict(number, family)
    _compare(verdict, maps_of(drawn.mechanism, tmp_path), drawn, INPUTS)
    assert {fault: verdict.faults[fault] for fault in FAULTS} == dict.fromkeys(FAULTS, 0)
    assert not verdict.open
    assert verdict.inputs >= INPUTS
    assert verdict.branches >= INPUTS
    assert verdict.largest < 1e-14


def maps_of(mechanism, folder):
    """Derive only the functions in MAPS for a mechanism, and load the mechanism."""
    known = makers(solved(mechanism))
    write(mechanism, folder, functions=[name for name in MAPS if name in known], languages=C_ALONE)
    return chasles.load(folder)


def test_nearby_assembly_mode_is_kept_distinct():
    drawn = drawn_mechanism(474)
    numbers = Multistart(drawn.mechanism)
    theta = np.array([[1.2654e-4, -1.2654e-4]])
    (modes,) = numbers.modes(theta[:, :1], numbers.actuated)
    apart = sorted(abs(mode["a_bar"] - theta[0, 1]) for mode in modes)
    assert apart[0] < 1e-12
    assert 9e-5 < apart[1] < 1e-4
    assert half_distance(numbers, modes, theta[0]) == pytest.approx(apart[1] / 2)


def test_multi_start_oracle_configurations_are_closed():
    drawn = drawn_mechanism(3)
    numbers = Multistart(drawn.mechanism)
    (modes,) = numbers.modes(drawn.q[None], numbers.actuated)
    assert len(modes) == 4
    for mode in modes:
        assert numbers.residual(mode, list(mode)) < 1e-14
        assert numbers.residual(mode | {"a_p": mode["a_p"] + 0.1}, ["a_p", "a_crank"]) > 1e-3
    apart = [np.abs(numbers.wrapped(list(a), _difference(a, modes[0]))).max() for a in modes[1:]]
    assert min(apart) > 0.1


def test_three_crank_linkage_is_mobile_only_uncrossed():
    drawn = drawn_mechanism(617)
    crossed = {"a_crank": -2.585394, "a_bar": 3.012836}
    numbers = Multistart(drawn.mechanism)
    (before, after) = numbers.modes(drawn.q + OFFSETS, numbers.actuated)
    assert [_nearest(numbers, modes, drawn.mode) < 2e-3 for modes in (before, after)] == [True] * 2
    assert mobility(drawn.mechanism).true == 1

    reference = dict(drawn.mechanism.reference)
    third = [name for name in reference if name.endswith("swing")]
    assert third
    at = np.array([crossed["a_crank"]])
    there = numbers.modes(at + OFFSETS, numbers.actuated)
    assert all(_nearest(numbers, modes, crossed) > 1e-2 for modes in there)
    struts = numbers.strut_values(crossed)
    values = {n: sp.Rational(f"{v:.6f}") for n, v in (crossed | struts).items()}
    rigid = replace(drawn.mechanism, reference=tuple((reference | values).items()))
    with pytest.raises(
        DescriptionError, match="0 degrees of freedom: the loops immobilize every body"
    ):
        derive(rigid)


def test_offset_universal_joint_closes_by_newton(tmp_path):
    plain = drawn_mechanism(12).mechanism
    aside = Translation((sp.Rational(5, 1000) * sp.nsimplify(Multistart(plain).size), 0, 0))
    joints = tuple(
        replace(j, before=(aside, *j.before)) if j.name == "u2" else j for j in plain.joints
    )
    mechanism = replace(plain, joints=joints)
    write(mechanism, tmp_path / "aside", functions=["configuration", "fk"], languages=C_ALONE)
    robot = chasles.load(tmp_path / "aside")
    assert robot.loop_solution == "newton"
    q = robot.reference.q + np.random.default_rng(0).uniform(-0.1, 0.1, (100, robot.n))
    z = robot.configuration(q)
    names = [variable.name for variable in robot.configuration_variables]
    gaps = Multistart(mechanism).gaps(dict(zip(names, z.T, strict=True)))
    assert gaps.max() < 1e-12


def _nearest(numbers, modes, mode):
    apart = [np.abs(numbers.wrapped(list(mode), _difference(mode, m))).max() for m in modes]
    return min(apart, default=np.inf)


def _difference(one, other):
    return np.array([one[name] - other[name] for name in one])
