"""Reads limits of coordinates, and the tables ``[couplings]`` and ``[motors]`` of robot files."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import get_args

import sympy as sp

from ..model.coupling import Coupling, Limits, Motor, MotorKind, contradictory, no_solution
from ..model.errors import DescriptionError
from ..model.kinds import JointKind, ParameterKind
from ..model.robot import Joint
from .plausibility import LARGEST_LIMIT, statement_of
from .suggestions import hint
from .toml_file import Keys, TomlFile, is_name, listed

MOTOR_FIELDS = ("type", "limits", "assumed")
OFFSET = "offset"
"""Name of the coupling field that states the joint value if all coordinates are zero."""


class CoordinateFile(TomlFile):
    """A robot file with joint or motor coordinates."""

    def couplings(self, joints: Sequence[Joint]) -> tuple[tuple[Coupling, ...], tuple[Motor, ...]]:
        """Read the couplings, and the motors that they name.

        A name that is neither a joint nor in ``[motors]`` becomes a revolute motor without limits.

        Args:
            joints: The joints of the file.

        Raises:
            DescriptionError: A coupling table is invalid, or a coupled joint is a fixed joint.
        """
        kinds: dict[str, str] = {j.name: j.kind for j in joints if j.kind != "fixed"}
        fixed = [joint.name for joint in joints if joint.kind == "fixed"]
        rules = self.table_at(("couplings",), {})
        motors = {name: self._motor(name) for name in self.table_at(("motors",), {})}
        for joint in rules:
            keys: Keys = ("couplings", joint)
            if joint not in kinds:
                self.fail(keys, f"a moving joint ({listed(kinds)}){hint(joint, kinds)}", joint)
            for name in self.table_at(keys):
                if not is_name(name) or name in fixed:
                    self.fail((*keys, name), "the name of a motor or of a moving joint", name)
                if name not in kinds and name != OFFSET:
                    motors.setdefault(name, Motor(name))
        known = kinds | {motor.name: motor.kind for motor in motors.values()}
        found = [self._coupling(joint, kinds[joint], known) for joint in rules]
        found += self.mimics(enumerate(joints), known)
        return tuple(found), tuple(motors.values())

    def joint_couplings(
        self, joints: Sequence[tuple[int, Joint]], kinds: Mapping[str, JointKind]
    ) -> tuple[Coupling, ...]:
        """Read the couplings between joints and cylinders of a robot with loops.

        Args:
            joints: Pairs (index in the file, joint) of all joints of the file.
            kinds: Types of the moving joints and cylinders by name.

        Raises:
            DescriptionError: A coupling table is invalid, or refers to a name that is neither a
                moving joint nor a cylinder.
        """
        found, rules = [], self.table_at(("couplings",), {})
        for joint in rules:
            keys: Keys = ("couplings", joint)
            if joint not in kinds:
                expected = f"a moving joint or a cylinder ({listed(kinds)})"
                self.fail(keys, f"{expected}{hint(joint, kinds)}", joint)
            for name in self.table_at(keys):
                if name not in kinds and name != OFFSET:
                    expected = (
                        f"a moving joint or a cylinder ({listed(kinds)}); a gear or a shaft with "
                        "its own angle is a revolute joint with a link"
                    )
                    self.fail((*keys, name), f"{expected}{hint(name, kinds)}", name)
            found.append(self._coupling(joint, kinds[joint], kinds))
        couplings = (*found, *self.mimics(joints, kinds))
        if wrong := contradictory(couplings):
            places: dict[str, Keys] = {joint.name: ("joints", k, "mimic") for k, joint in joints}
            places |= {joint: ("couplings", joint) for joint in rules}
            self.fail(places[wrong[-1]], f"equations with a solution ({no_solution(wrong)})", None)
        return couplings

    def mimics(
        self, joints: Iterable[tuple[int, Joint]], kinds: Mapping[str, str]
    ) -> Iterator[Coupling]:
        """Yield the couplings that joints state with ``mimic``.

        Args:
            joints: Pairs (index in the file, joint) of all joints of the file.
            kinds: Joint types of all joints that a mimic joint can follow, keyed by name.
        """
        for k, joint in joints:
            keys: Keys = ("joints", k, "mimic")
            if self.at(keys) is None:
                continue
            if joint.kind == "fixed":
                self.fail(keys, "no value for a fixed joint")
            if self.at(("couplings", joint.name)) is not None:
                self.fail(keys, f"one coupling of {joint.name}; [couplings] also states one")
            self.check_fields(keys, self.table_at(keys), ("joint", "multiplier", "offset"))
            others = [name for name in kinds if name != joint.name]
            leader = self.option((*keys, "joint"), others, "")
            own, its = (self.coordinate_scale(kinds[name]) for name in (joint.name, leader))
            ratio = self.literal((*keys, "multiplier"), 1) * own / its
            offset = self.literal((*keys, "offset"), 0) * own
            yield Coupling(joint.name, ((leader, ratio),), offset)

    def _coupling(self, joint: str, kind: str, kinds: Mapping[str, str]) -> Coupling:
        keys: Keys = ("couplings", joint)
        if OFFSET in kinds:
            self.fail(keys, f"another name for the joint {OFFSET!r}: {OFFSET} is a constant here")
        own = self.coordinate_scale(kind)
        ratios = [
            (name, self._ratio((*keys, name)) * own / self.coordinate_scale(kinds[name]))
            for name in self.table_at(keys)
            if name != OFFSET
        ]
        offset = self.number((*keys, OFFSET), "length" if kind == "prismatic" else "angle")
        try:
            return Coupling(joint, tuple(ratios), self.at_defaults(offset))
        except DescriptionError as error:
            self.fail(keys, f"ratios of coordinates ({error})", None)

    def _ratio(self, keys: Keys) -> sp.Expr:
        ratio = self.at_defaults(self.number(keys, "ratio"))
        if ratio == 0:
            self.fail(keys, "a nonzero ratio: the motion of the joint per unit of the coordinate")
        return ratio

    def _motor(self, name: str) -> Motor:
        keys: Keys = ("motors", name)
        self.check_fields(keys, self.table_at(keys), MOTOR_FIELDS)
        if not is_name(name):
            self.fail(keys, "the name of a motor", name)
        kind: MotorKind = self.option((*keys, "type"), get_args(MotorKind), "revolute")
        limits = self.limits((*keys, "limits"), kind)
        return Motor(name, kind, limits, self.assumed(keys, ("limits",)))

    def limits(self, keys: Keys, kind: JointKind) -> Limits:
        """Read the limits of a coordinate, a list of two numbers."""
        value = self.at(keys)
        if value is None:
            return None, None
        if not isinstance(value, list) or len(value) != 2:  # noqa: PLR2004
            self.fail(keys, "two numbers, [minimum, maximum]")
        if kind == "fixed":
            self.fail(keys, "no value for a fixed joint")
        scale = self.coordinate_scale(kind)
        quantity: ParameterKind = "length" if kind == "prismatic" else "angle"
        self.check_degrees(keys, value, quantity)
        lower, upper = (self.literal((*keys, side)) * scale for side in (0, 1))
        largest = max(abs(float(lower)), abs(float(upper)))
        if quantity not in self.stated and largest > LARGEST_LIMIT[quantity]:
            self.fail(keys, statement_of(quantity, LARGEST_LIMIT))
        if not float(lower) < float(upper):
            self.fail(keys, "a minimum below the maximum")
        return lower, upper

    def coordinate_scale(self, kind: str) -> sp.Expr:
        """Return the number of meters or radians per unit of a coordinate in the file."""
        return self.scale["length" if kind == "prismatic" else "angle"]
