"""Arms that cylinders, rods and cranks drive, as built: a sample of the benchmark's."""

import pytest

from bench.robustness.built_arms import BARS, judged


@pytest.mark.parametrize("number", [42, 44], ids=["beyond half a turn", "beside a dead point"])
def test_the_inverse_of_an_arm_as_built(number, monkeypatch):
    # The code runs once, and compiling it well takes longer.
    monkeypatch.setenv("CHASLES_CFLAGS", "-O0")
    found = judged(number)
    assert {key: vars(found)[key] <= bar for key, bar in BARS.items()} == dict.fromkeys(BARS, True)
