"""Tests the search for coordinates whose full turn does not change the configuration."""

import pytest

from chasles.contract.manifest import Coordinate, full_turns


def coordinates(*units):
    return tuple(Coordinate(f"c{k}", "", unit, None, None) for k, unit in enumerate(units))


@pytest.mark.parametrize(
    ("units", "joints", "C", "turns"),
    [
        (("rad", "m"), ("rad", "m"), ((1, 0), (0, 1)), (True, False)),
        (("rad", "rad"), ("rad", "rad"), ((1, 0), (-2, 1)), (True, True)),
        (("rad", "rad"), ("rad", "rad"), ((0.5, 0), (0.5, 3)), (False, True)),
        (("rad", "rad"), ("rad", "m"), ((1, 1), (2, 0)), (False, True)),
        (("m",), ("m",), ((2,),), (False,)),
    ],
    ids=["joints", "followers", "gears", "screws", "slides"],
)
def test_full_turns_of_coordinates_turn_all_joints_fully(units, joints, C, turns):
    assert full_turns(coordinates(*units), coordinates(*joints), C) == turns
