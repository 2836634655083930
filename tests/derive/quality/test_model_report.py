"""Model reports: determinants, ranks, and displacements that no parameter describes."""

from functools import cache

import numpy as np
import pytest
import sympy as sp
from numpy.testing import assert_allclose

from chasles.derive import Mechanism, model_report, read
from chasles.derive.chain.poe import placement_matrix
from chasles.derive.description.conventions import CONVENTIONS, dh, hayati5, mdh, mdh5
from chasles.derive.description.conventions.axis_maps import axis_map, numbers_of
from chasles.derive.quality.determinants import completed_determinant, determinant
from tests.support.convention_robots import drawn_chain
from tests.support.derivations import description

RANDOM = np.random.default_rng(3)
a, alpha, beta, d = sp.symbols("a alpha beta d", real=True)


@cache
def report_of(name):
    return model_report(read(description(name)))


@pytest.mark.parametrize(
    ("convention", "own", "whole"),
    [
        (mdh5, 4, 8 * sp.sin(alpha) ** 2),
        (
            hayati5,
            4 * (d**2 + 2) * sp.cos(beta) ** 4,
            8 * (a * sp.cos(alpha) * sp.cos(beta) ** 2) ** 2,
        ),
        (dh, 2 * (a**2 + 2), 8 * sp.sin(alpha) ** 4),
        (mdh, 2 * (d**2 + 2), 8 * sp.sin(alpha) ** 4),
    ],
    ids=lambda value: getattr(value, "name", ""),
)
def test_convention_determinants_match_papers(convention, own, whole):
    assert sp.expand(determinant(convention, "revolute") - own) == 0
    assert sp.expand(completed_determinant(convention, "revolute") - whole) == 0
    assert determinant(dh, "revolute").subs(a, 0) == 4


def by_definition(product, symbols, values):
    """Return det(D^T D), where D contains the parameter derivatives of a link transform."""
    A = placement_matrix(product)
    D = sp.Matrix.hstack(*(A.diff(symbol).reshape(16, 1) for symbol in symbols))
    D = np.array(D.xreplace(values).evalf(), dtype=float)
    return np.linalg.det(D.T @ D)


@pytest.mark.parametrize("convention", CONVENTIONS, ids=lambda convention: convention.name)
def test_convention_determinants_match_their_definition(convention):
    link = axis_map(convention, "revolute")
    for _ in range(1):
        values = {symbol: sp.Float(RANDOM.uniform(-1, 1)) for symbol in link.symbols}
        found = [
            float(det(convention, "revolute").xreplace(values))
            for det in (determinant, completed_determinant)
        ]
        own = by_definition(numbers_of(convention, "revolute"), link.own, values)
        whole = by_definition(link.product, link.symbols, values)
        assert_allclose(found, [own, whole], rtol=1e-9, atol=1e-12)


NAMES = ("ur5e", "well_manipulator")


@pytest.mark.parametrize("name", NAMES)
def test_rank_deficiency_equals_number_of_missed_displacements(name):
    report = report_of(name)
    assert report.identifiable - report.rank == sum(len(joint.misses) for joint in report.joints)
    assert report.suitable_rank == report.identifiable
    for joint in report.joints:
        suitable = {c.convention: c for c in joint.conventions}[joint.suitable]
        assert suitable.is_complete
        assert suitable.is_continuous
        assert str(joint.joint) in str(report)


PERPENDICULAR = "rotation about the perpendicular of axis and common normal"


def test_dh_misses_only_the_perpendicular_rotation():
    report = report_of("ur5e")
    missing = {found.joint: found.misses for found in report.joints if found.misses}
    assert missing == {"elbow": (PERPENDICULAR,), "wrist_1": (PERPENDICULAR,)}


def test_well_manipulator_report_matches_paper_counts():
    assert isinstance(read(description("well_manipulator")), Mechanism)
    report = report_of("well_manipulator")
    assert (report.revolute, report.prismatic, report.identifiable) == (5, 2, 30)
    assert report.suitable_rank == 30
    by_name = {joint.joint: joint for joint in report.joints}
    found = {c.convention: c for c in by_name["theta3"].conventions}
    assert found["mdh5"].value == 0
    assert found["hayati5"].value == pytest.approx(8 * 0.9687**2)
    assert found["mdh5"].misses == (PERPENDICULAR,)
    assert not found["dh"].is_complete
    assert found["hayati"].is_minimal
    assert not found["hayati5"].is_minimal


def test_printed_report_names_displacements_missed_by_dh():
    text = str(report_of("ur5e"))
    assert "as described: 36 parameters with base and tool, rank 28: misses 2 of 30" in text
    assert "as suited: 38 parameters with base and tool, rank 30: complete" in text
    assert (
        "dh          0     misses rotation about the perpendicular of axis and common normal"
        in text
    )


TURNS, MIXED = ("revolute",) * 3, ("revolute", "revolute", "prismatic", "revolute")
INCOMPLETE = {"poe": (TURNS, MIXED), "s_model": (MIXED,)}
"""Joint types of arms that a convention cannot describe completely, keyed by the convention. These
conventions have too few parameters. A vector that represents a direction has no free parameters. In
a product of motions, the parameters of an S-model come after a rotation and before a translation.
"""


DRAWN = [
    *((convention, MIXED) for convention in CONVENTIONS),
    *((convention, TURNS) for convention in CONVENTIONS if convention.name in INCOMPLETE),
]


@pytest.mark.parametrize(
    ("convention", "kinds"),
    DRAWN,
    ids=[f"{c.name}-{'turns' if kinds is TURNS else 'mixed'}" for c, kinds in DRAWN],
)
def test_random_chains_are_incomplete_only_in_poe_and_s_model(convention, kinds):
    report = model_report(drawn_chain(convention, np.random.default_rng(1), kinds), conventions=())
    missing = sum(len(joint.misses) for joint in report.joints)
    assert report.identifiable - report.rank == missing
    assert (missing > 0) == (kinds in INCOMPLETE.get(convention.name, ()))
    assert report.suitable_rank == report.identifiable
