"""Branches of drawn mechanisms beside a multi-start Newton, a sample of the benchmark's."""

import numpy as np
import pytest

from bench.accuracy.mechanism_branches import FAULTS, half_way, judged
from bench.accuracy.multi_start import Multistart
from bench.cases.drawn_mechanisms import FAMILIES, drawn_mechanism

INPUTS = 6
FIRST = 520
"""Number of a mechanism of the first family, behind those of the benchmark."""


@pytest.mark.parametrize("k", range(len(FAMILIES)), ids=list(FAMILIES))
def test_branches_of_a_family(k, monkeypatch):
    # The code runs once, and compiling it well takes longer.
    monkeypatch.setenv("CHASLES_CFLAGS", "-O0")
    verdict = judged(drawn_mechanism(FIRST + k), FIRST + k, INPUTS, is_short=True)
    assert verdict.crash == ""
    assert {fault: verdict.faults[fault] for fault in FAULTS} == dict.fromkeys(FAULTS, 0)
    assert not verdict.open
    assert verdict.inputs >= INPUTS
    assert verdict.branches >= INPUTS
    assert verdict.largest < 1e-14


def test_a_neighbouring_mode_is_not_the_same():
    """Its crank is drawn at 1e-4 from the fold: the crossed mode is as near as the tolerance."""
    drawn = drawn_mechanism(474)
    numbers = Multistart(drawn.mechanism)
    theta = np.array([[1.2654e-4, -1.2654e-4]])
    (modes,) = numbers.modes(theta[:, :1], numbers.actuated)
    apart = sorted(abs(mode["a_bar"] - theta[0, 1]) for mode in modes)
    assert apart[0] < 1e-12
    assert 9e-5 < apart[1] < 1e-4
    assert half_way(numbers, modes, theta[0]) == pytest.approx(apart[1] / 2)


def test_the_oracle_s_configurations_are_closed():
    drawn = drawn_mechanism(3)
    numbers = Multistart(drawn.mechanism)
    (modes,) = numbers.modes(drawn.q[None], numbers.actuated)
    assert len(modes) == 4
    for mode in modes:
        assert numbers.residual(mode, list(mode)) < 1e-14
        assert numbers.residual(mode | {"a_p": mode["a_p"] + 0.1}, ["a_p", "a_crank"]) > 1e-3
    apart = [np.abs(numbers.wrapped(list(a), _difference(a, modes[0]))).max() for a in modes[1:]]
    assert min(apart) > 0.1


def _difference(one, other):
    return np.array([one[name] - other[name] for name in one])
