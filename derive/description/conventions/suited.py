"""Selects a convention for the calibration of each joint.

If consecutive axes are not parallel, the modified Denavit-Hartenberg parameters are complete and
minimal. If consecutive axes are nearly parallel, the common normal is discontinuous, so Hayati's
parameters are used. If consecutive axes nearly coincide, the parameters of Denavit-Hartenberg and
Hayati fail, so a full pose describes the joint.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import mpmath
import sympy as sp

from chasles.contract import check_type

from ...model.convention import Convention, Fitted
from ...model.errors import DescriptionError
from ...model.placements import Placement, Vector
from ...model.robot import Joint, Parameter, SerialRobot
from ...model.tolerances import CONTINUOUS_MODEL, EVALUATION_DIGITS
from ..pose_error import pose_in_digits
from .axis_lines import fitted
from .denavit_hartenberg import mdh
from .fitted_poses import along_z, axis_line, home_pose, placement_of, xyz_rpy_of
from .five_parameters import hayati5
from .neighbours import Neighbours, least_singular_value, neighbours
from .urdf_origin import urdf

SUITED = (mdh, hayati5, urdf)
"""Conventions that can be mixed in one chain."""


def suitable_convention(pair: Neighbours) -> Convention:
    """Return the first continuous convention in ``SUITED``.

    If none is continuous, return the last one.
    """
    for convention in SUITED[:-1]:
        if least_singular_value(pair.displacements(convention)) > CONTINUOUS_MODEL:
            return convention
    return SUITED[-1]


def suitable_conventions(robot: SerialRobot) -> tuple[tuple[Neighbours, Convention], ...]:
    """Return pairs of a moving joint and a suitable convention.

    A prismatic axis is moved to the origin of the preceding link.
    """
    with mpmath.workdps(EVALUATION_DIGITS):
        placed, _ = _placed(neighbours(robot))
        return tuple((item.pair, item.convention) for item in placed)


def with_suitable_conventions(robot: SerialRobot) -> SerialRobot:
    """Describe each joint by the convention that suits its calibration.

    In a suitable convention, small errors of the joint axis need only small changes of the
    parameters. The tool pose, coordinates, limits and couplings stay the same. The new conventions
    determine the link frames. Fixed joints become part of the links. Named parameters, except
    helical pitches, are replaced by their values. Multiples of 15 degrees and numbers with fewer
    than 25 digits stay exact.

    Args:
        robot: A serial robot, for example from ``read``.

    Returns:
        The robot in the new conventions: "mdh", "hayati5" or "urdf".

    Raises:
        DescriptionError: The robot has masses, whose positions refer to the old link frames.
    """
    check_type("with_suitable_conventions: robot", robot, SerialRobot)
    if robot.load is not None:
        raise DescriptionError(
            f"{robot.name}: masses are positioned in link frames, which change with "
            "the conventions; set the convention of each joint"
        )
    with mpmath.workdps(EVALUATION_DIGITS):
        pairs = neighbours(robot)
        values = {parameter.symbol: parameter.value for parameter in robot.parameters}
        placed, frame = _placed(pairs)
        tool = frame**-1 * home_pose(robot, values)
        joints = tuple(item.as_joint() for item in placed)
        return replace(
            robot,
            joints=joints,
            base=placement_of(placed[0].before),
            tool=placement_of(tool),
            parameters=_used(robot, joints),
        )


@dataclass
class _Placed:
    pair: Neighbours
    convention: Convention
    fitted: Fitted
    before: Any
    turn: sp.Expr = sp.S.Zero
    shift: sp.Expr = sp.S.Zero

    def fields(self) -> dict[str, sp.Expr | Vector]:
        """Return the values of all fields.

        They include the rotation about the joint axis and the shift along it.
        """
        fields = dict(self.fitted.values)
        if self.convention.turning:
            return fields | {
                self.convention.turning: self.turn,
                self.convention.sliding: self.shift,
            }
        # The pose fields xyz and rpy contain the rotation and the shift.
        T = pose_in_digits(self._own() + along_z(self.turn, self.shift), {})
        xyz, rpy = xyz_rpy_of(T)
        return fields | {"xyz": xyz, "rpy": rpy}

    def _own(self) -> Placement:
        return self.convention(self.pair.joint.kind, **self.fitted.values)[0]

    def after(self) -> Any:
        """Return the joint frame (4, 4).

        The frame excludes the rotation about the joint axis and the shift along it.
        """
        return self.before * pose_in_digits(self._own(), {})

    def as_joint(self) -> Joint:
        """Return the joint in the selected convention."""
        given = self.convention.scalars(
            {f.name: f.value(self.fields()) for f in self.convention.fields}
        )
        before, after = self.convention(self.pair.joint.kind, **self.fields())
        return replace(
            self.pair.joint,
            before=before,
            after=after,
            convention=self.convention,
            given=given,
            assumed=tuple(name for name in self.pair.joint.assumed if name in ("limits", "pitch")),
        )


def _placed(pairs: Sequence[Neighbours]) -> tuple[list[_Placed], Any]:
    """Return the joints in their conventions, and the frame after the last joint."""
    first = pairs[0]
    # The pose of the base frame defines the first axis.
    placed = [_Placed(first, SUITED[0], fitted({}), first.frame)]
    frame = original = first.frame
    for pair in pairs[1:]:
        original = original * pair.frame
        relative = frame**-1 * original
        moved = replace(pair, line=axis_line(relative, pair.joint))
        convention = suitable_convention(moved)
        found = moved.fit(convention)
        assert found is not None
        frame = frame * pose_in_digits(along_z(found.turn, found.shift), {})
        placed[-1].turn, placed[-1].shift = found.turn, found.shift
        placed.append(_Placed(moved, convention, found, frame))
        frame = placed[-1].after()
    return placed, frame


def _used(robot: SerialRobot, joints: Sequence[Joint]) -> tuple[Parameter, ...]:
    used = {symbol for joint in joints for symbol in joint.pitch.free_symbols}
    return tuple(parameter for parameter in robot.parameters if parameter.symbol in used)
