"""Joint compliance under gravity: identification and robot files."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chasles import se3
from chasles.calibration import Positions, identify
from chasles.calibration.calibrated_file import robot_file
from chasles.derive import DescriptionError, derive, read_text
from chasles.errors import InputValueError
from tests.support.compiling import compiled, compiled_with_vectors
from tests.support.convention_robots import sagging_ur5e

SIGMA = 2e-5
YIELD = np.array([3e-5, 5e-5, 8e-5, 1e-4, 1e-4, 2e-4])
"""Joint compliances [rad/(N m)]; the wrist of a small arm is the most compliant."""


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sagging") / "ur5e"
    functions = ["fk", "fk_p", "jacobian_p", "identification_jacobian"]
    return compiled(read_text(sagging_ur5e()), folder, functions, ["c"])


def part(arm, name):
    return np.array([g.part == name for g in arm.geometry])


def torques(arm, q, p):
    J, by_compliance = arm.jacobian_p(q, p), arm.identification_jacobian(q, p)
    columns = by_compliance[..., part(arm, "compliance")]
    return (J * columns).sum(-2) / (J**2).sum(-2)


def in_equilibrium(arm, q, p):
    """Return poses in which springs and gravity are in equilibrium."""
    rigid = np.where(part(arm, "compliance"), 0, p)
    sagged = q
    for _ in range(8):
        sagged = q + YIELD * torques(arm, sagged, rigid)
    return arm.fk_p(sagged, rigid)


@pytest.fixture(scope="module")
def measured(arm):
    random = np.random.default_rng(2)
    p = np.array([g.value for g in arm.geometry])
    p[part(arm, "axis")] += random.uniform(-1e-3, 1e-3, part(arm, "axis").sum())
    q = random.uniform(-2.5, 2.5, (50, 6))
    targets = random.uniform(-0.15, 0.15, (3, 3))
    T = se3.exp(random.normal(size=6)) @ in_equilibrium(arm, q, p)
    points = T[:, None, :3, 3] + np.einsum("nij,mj->nmi", T[:, :3, :3], targets)
    return q, Positions(points + SIGMA * random.normal(size=points.shape), SIGMA)


@pytest.fixture(scope="module")
def found(arm, measured):
    return identify(arm, *measured, vary=("axis", "compliance"), robust=False)


def test_joint_compliances_are_identified(arm, measured, found):
    rigid = identify(arm, *measured, robust=False)
    assert rigid.noise > 5
    assert found.noise < 1.1
    # The first axis is vertical to within a milliradian, so gravity hardly deflects the first
    # joint.
    springs = found.p[part(arm, "compliance")]
    std = dict(zip(found.names, found.std, strict=True))
    for k in range(1, 6):
        name = f"{arm.coordinates[k].name}_compliance"
        assert abs(springs[k] - YIELD[k]) < 4 * std[name]
        assert std[name] < 0.1 * YIELD[k]


SLIDING = """
name = "sliding"
convention = "dh"
gravity = ["0.5", 0, "-9.7"]
[[joints]]
alpha = "1.2"
d = "0.2"
[[joints]]
type = "prismatic"
limits = ["-0.5", 1]
alpha = "0.3"
theta = "0.4"
link = "slider"
[[joints]]
name = "elbow"
link = "forearm"
a = "-0.4"
alpha = "0.5"
direction = -1
[[joints]]
type = "fixed"
a = "0.1"
link = "plate"
[[masses]]
link = "slider"
mass = 3
[[masses]]
link = "forearm"
mass = "1.2"
[[masses]]
link = "plate"
mass = "2.5"
at = ["0.1", "0.02", "-0.3"]
"""
FUNCTIONS = ["fk", "coordinates_from_readings", "readings_from_coordinates"]


def sagging(arm, random, soft=slice(None)):
    """Return a geometry with errors in all parameters and compliant joints."""
    p = np.array([g.value for g in arm.geometry])
    off = np.array([g.part in ("axis", "offset", "transmission", "tool") for g in arm.geometry])
    p[off] += random.uniform(-1e-3, 1e-3, off.sum())
    springs = np.flatnonzero(part(arm, "compliance"))[soft]
    p[springs] = random.uniform(0, 1e-4, springs.size)
    return p


def check_file(arm, folder, functions, seed, soft=slice(None)):
    random = np.random.default_rng(seed)
    p, shown = sagging(arm, random, soft), random.uniform(-0.5, 1, (500, arm.n))
    mine = compiled(read_text(robot_file(arm, p, "mine", "simulated")), folder, functions, ["c"])
    true = mine.coordinates_from_readings(shown)
    rigid = np.where(part(arm, "compliance"), 0, p)
    T = arm.fk_p(shown, p)
    assert np.abs(T - arm.fk_p(shown, rigid)).max() > 1e-4
    assert_allclose(mine.fk(true), T, rtol=0, atol=1e-12)
    assert_allclose(mine.readings_from_coordinates(true), shown, rtol=0, atol=1e-14)
    return mine, p, T


def test_robot_file_with_springs_reproduces_sag_and_ik(arm, tmp_path):
    with compiled_with_vectors():
        mine, p, T = check_file(arm, tmp_path, [*FUNCTIONS, "ik"], 3, soft=[2])
    found = mine.ik(T)
    back = arm.fk_p(mine.readings_from_coordinates(found.q), p)
    gaps = np.abs(back - T[:, None]).max((-2, -1))[found.valid]
    assert found.valid.any(-1).all()
    assert gaps.max() < 1e-10


def test_robot_file_reproduces_sag_with_prismatic_joints(tmp_path):
    arm = compiled(read_text(SLIDING), tmp_path / "arm", ["fk", "fk_p", "jacobian_p"], ["c"])
    check_file(arm, tmp_path / "mine", FUNCTIONS, 4, soft=[1, 2])


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("limits = [-0.5, 1.0]\n", "", "a spring requires joint limits"),
        (
            'coordinate = "elbow"\ncompliance = ',
            'coordinate = "elbow"\ncompliance = 1e3  # ',
            "of at most",
        ),
        (
            '[[springs]]\ncoordinate = "elbow"',
            '[[springs]]\ncoordinate = "wrist"',
            "a spring for each coordinate",
        ),
        ("mass = 3.0\ncenter", "weight = 3.0\ncenter", "weight"),
    ],
    ids=["no limits", "excessive compliance", "missing coordinate", "unknown key"],
)
def test_invalid_springs_are_rejected_by_name(old, new, expected, tmp_path):
    arm = compiled(read_text(SLIDING), tmp_path / "arm", ["fk", "fk_p", "jacobian_p"], ["c"])
    text = robot_file(arm, sagging(arm, np.random.default_rng(4)), "mine", "simulated")
    assert text.count(old) == 1
    with pytest.raises(DescriptionError, match=expected):
        derive(read_text(text.replace(old, new)), functions=FUNCTIONS)


MIMICKED = """
name = "mimicked"
convention = "dh"
gravity = [0, "-9.7", 0]
[[joints]]
name = "elbow"
a = "0.4"
[[joints]]
link = "hand"
a = "0.1"
mimic = { joint = "elbow", multiplier = "1/2" }
[[masses]]
link = "hand"
mass = 1
"""


def test_springs_of_arm_with_followers_cannot_be_written(tmp_path):
    moved = read_text(MIMICKED)
    arm = compiled(moved, tmp_path, ["fk_p", "jacobian_p"], ["c"])
    p = np.array([g.value for g in arm.geometry])
    p[part(arm, "compliance")] = 1e-5
    with pytest.raises(InputValueError, match="a joint depends on other joints"):
        robot_file(arm, p, "mine", "simulated")
