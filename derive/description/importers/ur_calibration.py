"""Applies the factory calibration of a UR arm to its description.

The controller stores deviations of the DH parameters of six rows (``calibration.conf``:
delta_theta, delta_a, delta_d, delta_alpha). Axes 2, 3 and 4 are nearly parallel, so their common
normals are inaccurate. Therefore, delta_d is often many meters. The ROS driver writes the pose of
each link relative to the preceding link (``kinematics:`` in YAML: x, y, z, roll, pitch, yaw). The
ROS driver moves the link frames along their axes to avoid large numbers. The reader converts both
file formats to poses of links.

Source:
    Universal Robots, ROS driver, package ur_calibration: page "algorithm" of its documentation, and
    the joints of ur_description.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import mpmath as mp
import sympy as sp

from chasles.contract.argument_types import check_type
from chasles.contract.extras import requires
from chasles.contract.input_files import as_path

from ...model.errors import DescriptionError
from ...model.exact import NotExact, read
from ...model.mechanism import Described, Mechanism
from ...model.placements import Rotation, Vector
from ...model.robot import Joint, SerialRobot
from ...model.tolerances import CALIBRATED_TOOL, EVALUATION_DIGITS, ROUNDING
from ..conventions.denavit_hartenberg import dh
from ..conventions.urdf_origin import urdf
from ..file_text import text_of
from ..toml_file import file_error
from .roll_pitch_yaw import of_matrix

if TYPE_CHECKING:
    from yaml import Node

LINKS = ("shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")
"""Names of the links in the YAML file. The entry of a link is its pose in the frame of the
preceding link."""
COORDINATES = ("x", "y", "z", "roll", "pitch", "yaw")
DELTAS = ("theta", "d", "a", "alpha")
NEARLY_PARALLEL = (1, 2)
"""Rows of the upper arm and the forearm, whose axes are nearly parallel to the next axis."""
WRITTEN_DIGITS = 20
"""Number of digits of the computed placements. This number exceeds the precision of a double."""


@dataclass(frozen=True)
class LinkPose:
    """Pose of a joint in the preceding link: position (meter), and roll, pitch, yaw (radian)."""

    xyz: Vector
    rpy: Vector


def apply_calibration(description: Described, path: str | Path) -> SerialRobot:
    """Replace the nominal geometry of a Universal Robots arm by its factory calibration.

    Args:
        description: The nominal arm with six revolute joints, described by DH parameters or by
            URDF origins whose joint axes are z axes.
        path: The file ``calibration.conf`` from the controller, or the ``.yaml`` file from the ROS
            driver.

    Returns:
        The calibrated arm, with joints in the "urdf" convention. Names, limits, base frame and tool
        frame stay the same.

    Raises:
        DescriptionError: The file is not a calibration, or the robot is not a UR arm. The error is
            also raised if the calibration moves the tool at q = 0 by more than 0.05 m or about 2
            degrees. Such a calibration belongs to a different type of UR arm.
    """
    check_type("apply_calibration: description", description, SerialRobot, Mechanism)
    file = as_path("path", path)
    with mp.workdps(EVALUATION_DIGITS):
        try:
            return _measured(_arm(description, file), _File(file), file)
        except NotExact as error:
            raise DescriptionError(f"{file}: a number is out of range: {error}") from None


def _measured(arm: SerialRobot, calibration: "_File", file: Path) -> SerialRobot:
    names = (joint.name for joint in arm.moving)
    poses = dict(zip(names, calibration.poses(arm), strict=True))
    measured = replace(
        arm,
        joints=tuple(_placed(j, poses[j.name]) if j.name in poses else j for j in arm.joints),
        parameters=(),
        source=f"{arm.source}; calibration {file.name}{calibration.hash}",
        notes=(*arm.notes, f"calibration: {file.name}{calibration.hash}"),
    )
    apart = _tool_at_zero(measured) - _tool_at_zero(arm)
    distance = float(mp.norm(apart[:3, 3]))
    if max(distance, float(mp.norm(apart[:3, :3]))) > CALIBRATED_TOOL:
        expected = f"the calibration of a {arm.title or arm.name}"
        raise DescriptionError(
            f"{file}: expected {expected}; at q = 0, the tool differs by {distance:.3f} m"
        )
    return measured


def _arm(robot: Described, file: Path) -> SerialRobot:
    """Return the robot if it is a chain of six revolute joints."""
    if isinstance(robot, SerialRobot):
        names = [joint.name for joint in robot.joints]
        moving = robot.moving
        first, last = names.index(moving[0].name), names.index(moving[-1].name)
        turning = all(j.kind == "revolute" and j.direction == 1 for j in moving)
        if turning and not robot.couplings and len(moving) == len(LINKS) == last - first + 1:
            return robot
    expected = "six consecutive revolute joints without fixed joints in between"
    raise DescriptionError(
        f"{file}: the calibration belongs to a UR arm such as ur5 or ur5e; expected {expected}, "
        f"got {robot.name}"
    )


def _placed(joint: Joint, pose: LinkPose) -> Joint:
    given: dict[str, Vector] = {
        "xyz": pose.xyz,
        "rpy": pose.rpy,
        "axis": (sp.S(0), sp.S(0), sp.S(1)),
    }
    before, after = urdf("revolute", **given)
    return replace(joint, before=before, after=after, convention=urdf, given=urdf.scalars(given))


# --- the calibration file itself ---


class _File:
    """A calibration file with link poses or with deviations of DH parameters."""

    def __init__(self, file: Path) -> None:
        self.file = file
        self.text = text_of(file)
        self.hash = ""

    def poses(self, robot: SerialRobot) -> tuple[LinkPose, ...]:
        if self.file.suffix in (".yaml", ".yml"):
            return self._of_yaml()
        if self.file.suffix != ".conf":
            self._fail(None, "", self.file.suffix, "a calibration file, .yaml or .conf")
        return _without_large_offsets(self._rows(robot))

    def _of_yaml(self) -> tuple[LinkPose, ...]:
        with requires("chasles[files]"):
            import yaml  # noqa: PLC0415

        try:
            root = yaml.compose(self.text, Loader=yaml.SafeLoader)
        except yaml.YAMLError as error:
            mark = getattr(error, "problem_mark", None)
            line = mark.line + 1 if mark else None
            self._fail(line, "", None, f"valid YAML ({getattr(error, 'problem', error)})")
        except RecursionError:
            self._fail(None, "", None, "fewer brackets in brackets")
        top = _entries(root)
        if "kinematics" not in top:
            self._fail(1, "kinematics", None, "a table kinematics, as the ROS driver writes it")
        links = _entries(top["kinematics"])
        if "hash" in links and links["hash"].id == "scalar":
            self.hash = f" ({links['hash'].value})"
        return tuple(self._pose(link, links, top["kinematics"]) for link in LINKS)

    def _pose(self, link: str, links: Mapping[str, "Node"], table: "Node") -> LinkPose:
        line = table.start_mark.line + 1
        if link not in links:
            self._fail(line, f"kinematics.{link}", None, f"a table with {', '.join(COORDINATES)}")
        entries = _entries(links[link])
        values = []
        for name in COORDINATES:
            field = f"kinematics.{link}.{name}"
            if name not in entries:
                self._fail(links[link].start_mark.line + 1, field, None, "a number")
            at = entries[name]
            text = at.value if at.id == "scalar" else f"a {at.id}"
            values.append(self._number(at.start_mark.line + 1, field, text))
        x, y, z, roll, pitch, yaw = values
        return LinkPose((x, y, z), (roll, pitch, yaw))

    def _rows(self, robot: SerialRobot) -> list[list[mp.mpf]]:
        """Return the rows (theta, d, a, alpha), with the calibration deviations added."""
        deltas = {name: self._deltas(f"delta_{name}") for name in DELTAS}
        defaults = {parameter.symbol: parameter.value for parameter in robot.parameters}
        rows = []
        for k, joint in enumerate(robot.moving):
            if joint.convention != dh:
                expected = (
                    "an arm in DH parameters (convention dh), such as ur5e, for deviations of"
                )
                self._fail(None, "", None, f"{expected} them: joint {joint.name} has none")
            given = dict(joint.given)
            row = [given[name].xreplace(defaults) + deltas[name][k] for name in DELTAS]
            rows.append([_evaluated(value) for value in row])
        last = len(LINKS) - 1
        for name in ("a", "alpha"):
            if deltas[name][last] != 0:
                expected = "0 for the last joint, whose frame is the tool's"
                self._fail(self._line(f"delta_{name}"), f"delta_{name}", None, expected)
        return rows

    def _deltas(self, name: str) -> list[sp.Expr]:
        line = self._line(name)
        found = re.search(rf"(?m)^[ \t]*{name}[ \t]*=[ \t]*\[([^]]*)\]", self.text)
        words = found[1].split(",") if found else []
        if len(words) != len(LINKS):
            self._fail(line, name, None, f"{name} = [six numbers]")
        return [self._number(line, name, word.strip()) for word in words]

    def _line(self, name: str) -> int | None:
        lines = self.text.splitlines()
        return next((k for k, line in enumerate(lines, 1) if line.strip().startswith(name)), None)

    def _number(self, line: int | None, field: str, text: str) -> sp.Expr:
        try:
            value = read(text)
        except NotExact as error:
            self._fail(line, field, text, f"a decimal number ({error})")
        if not value.is_Rational:
            self._fail(line, field, text, "a decimal number")
        return value

    def _fail(self, line: int | None, field: str, value: object, expected: str) -> NoReturn:
        raise file_error(str(self.file), line, field, value, expected) from None


def _entries(node: "Node | None") -> dict[str, "Node"]:
    """Return the entries of a YAML table, or {} for any other node."""
    pairs = node.value if node is not None and node.id == "mapping" else []
    # Only scalar keys are read, because nested aliases could make the text of other keys very long.
    return {key.value: value for key, value in pairs if key.id == "scalar"}


# --- DH rows to poses without large link offsets ---


def _without_large_offsets(rows: Sequence[Sequence[mp.mpf]]) -> tuple[LinkPose, ...]:
    """Convert DH rows (theta, d, a, alpha) to poses of the joints.

    The origin of a joint may be any point of the joint axis. For each row index in
    ``NEARLY_PARALLEL``, the origin after the row is moved along its joint axis. The new origin is
    in the plane that contains the preceding origin and is normal to the preceding axis. The tool
    pose stays the same.
    """
    turns = [_turn("z", theta) * _shift(0, 0, d) for theta, d, _, _ in rows]
    arms = [_shift(a, 0, 0) * _turn("x", alpha) for _, _, a, alpha in rows]
    for k in NEARLY_PARALLEL:
        if rows[k][1] == 0 and turns[k][2, 3] == 0:
            continue
        behind = turns[k] * arms[k]
        along = -behind[2, 3] / behind[2, 2]
        foot = behind * mp.matrix([0, 0, along, 1])
        direction = mp.atan(foot[1] / foot[0])
        turns[k] = _turn("z", direction)
        arms[k] = mp.chop(turns[k].T * behind * _shift(0, 0, along), ROUNDING)
        turns[k + 1] = _shift(0, 0, -along) * turns[k + 1]
    poses = [turns[0], *(arms[k] * turns[k + 1] for k in range(len(rows) - 1))]
    return tuple(_link_pose(pose) for pose in poses)


def _link_pose(pose: mp.matrix) -> LinkPose:
    x, y, z = (_written(pose[row, 3]) for row in range(3))
    roll, pitch, yaw = (_written(angle) for angle in of_matrix(pose))
    return LinkPose((x, y, z), (roll, pitch, yaw))


def _written(value: mp.mpf) -> sp.Expr:
    return read(mp.nstr(value, WRITTEN_DIGITS))


def _turn(axis: str, angle: mp.mpf) -> mp.matrix:
    j, k = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    turned = mp.eye(4)
    turned[j, j] = turned[k, k] = mp.cos(angle)
    turned[k, j] = mp.sin(angle)
    turned[j, k] = -turned[k, j]
    return turned


def _shift(x: mp.mpf, y: mp.mpf, z: mp.mpf) -> mp.matrix:
    shifted = mp.eye(4)
    shifted[0, 3], shifted[1, 3], shifted[2, 3] = x, y, z
    return shifted


def _evaluated(value: sp.Expr) -> mp.mpf:
    return mp.mpf(str(value.evalf(EVALUATION_DIGITS)))


def _tool_at_zero(robot: SerialRobot) -> mp.matrix:
    """Return the tool pose at the configuration q = 0."""
    defaults = {parameter.symbol: parameter.value for parameter in robot.parameters}
    pose = mp.eye(4)
    for motion in (motion for placement in robot.placements for motion in placement):
        if isinstance(motion, Rotation):
            pose *= _turn(motion.axis, _evaluated(motion.angle.xreplace(defaults)))
        else:
            pose *= _shift(*(_evaluated(value.xreplace(defaults)) for value in motion.vector))
    return pose
