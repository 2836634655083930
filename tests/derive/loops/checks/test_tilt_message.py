"""The message about an almost planar loop contains only the deviations of this loop."""

import pytest

from chasles.derive.loops.closing.tilted_pins import Tilt

TURNED = "the axis of 'boom' is 2 mrad out of parallel with the others"
APART = "the ends of 'lift' are 1 mm apart along the axes"


@pytest.mark.parametrize(
    ("angle", "offset", "text"),
    [
        (2e-3, 0.0, TURNED),
        (1e-17, 1e-3, APART),
        (2e-3, 1e-3, f"{TURNED}, and {APART}"),
    ],
)
def test_deviation_of_zero_is_omitted(angle, offset, text):
    assert str(Tilt("lift", "boom", angle, offset, 0.6, 3)) == text
