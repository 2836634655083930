"""Reads serial robots from robot files."""

from collections.abc import Iterable, Mapping, Sequence
from typing import ClassVar, NoReturn

import sympy as sp

from ..model.convention import Convention, FieldKind
from ..model.errors import DescriptionError
from ..model.kinds import JointKind
from ..model.mechanism import Described
from ..model.placements import Placement, Vector, from_xyz_rpy
from ..model.robot import (
    Joint,
    Load,
    PointMass,
    SerialRobot,
    Spring,
    Springs,
    Transmission,
)
from .assumptions import assumption
from .conventions import CONVENTIONS, poe
from .coupling_tables import CoordinateFile
from .toml_file import FRAME, Keys, TomlFile, Word, dotted, listed

MAX_JOINTS = 256
AUTO = "auto"
"""Value of ``convention`` in robot files that state joint axes as lines in space. chasles selects a
DH convention for each joint."""
ROBOT_FIELDS = (
    "name",
    "title",
    "source",
    "convention",
    "units",
    "parameters",
    "base",
    "tool",
    "joints",
    "transmissions",
)
COUPLING_FIELDS = ("couplings", "motors")
TRANSMISSION_FIELDS = ("coordinate", "gain", "sin1", "cos1", "sin2", "cos2")
LOAD_FIELDS = ("masses", "gravity", "springs")
SPRING_FIELDS = ("coordinate", "compliance", "axis", "point", "mass", "center")
JOINT_FIELDS = ("name", "type", "convention", "limits", "link", "pitch", "direction", "assumed")
_WAVES = ("sin1", "cos1", "sin2", "cos2")
KINDS: tuple[JointKind, ...] = ("revolute", "prismatic", "helical", "fixed")
_TURNS = "revolute joints in series with intersecting axes"
IN_SERIES: Mapping[str, str] = {
    "universal": f"two {_TURNS}",
    "spherical": f"three {_TURNS}",
    "ball": f"three {_TURNS}",
    "cylindrical": "a prismatic and a revolute joint in series, on one axis",
}
"""Joint types with several degrees of freedom, and the joints that a file must state instead."""


class RobotFile(CoordinateFile):
    """A file that describes a serial robot."""

    joint_fields: ClassVar[tuple[str, ...]] = (*JOINT_FIELDS, "mimic")
    of_lines: ClassVar[Mapping[str, Convention]] = {AUTO: poe}
    """Values of the file's field ``convention`` that are not names of conventions, such as "auto".
    """

    def __init__(
        self,
        file: str,
        text: str,
        extending: TomlFile | None = None,
        conventions: Sequence[Convention] = CONVENTIONS,
    ) -> None:
        """Read the text of a file. See ``TomlFile``.

        Args:
            file: File name for error messages.
            text: TOML text.
            extending: A file that extends this file.
            conventions: The conventions that the file may use.
        """
        super().__init__(file, text, extending)
        self._conventions = {convention.name: convention for convention in conventions}
        self._taken: dict[tuple[str, str], Keys] = {}

    def described(self) -> Described:
        """Return the robot that the file describes, as a SerialRobot or a Mechanism."""
        return self.robot()

    def robot(self) -> SerialRobot:
        """Return the robot.

        Raises:
            DescriptionError: The file is invalid.
        """
        self.check_fields((), self.table, (*ROBOT_FIELDS, *COUPLING_FIELDS, *LOAD_FIELDS))
        name = self.robot_name()
        self.declare_units()
        self.declare_parameters()
        base, base_frame = self._frame("base", "0")
        tool, tool_frame = self._frame("tool", "ee")
        joints = self._joints()
        couplings, motors = self.couplings(joints)
        load = self.load()
        transmissions = tuple(map(self._transmission, self._each("transmissions")))
        parameters = tuple(self.parameter(name) for name in self.symbols)
        try:
            return SerialRobot(
                name=name,
                joints=joints,
                title=self.string(("title",), name),
                source=self.string(("source",), ""),
                base=base,
                tool=tool,
                base_frame=base_frame,
                tool_frame=tool_frame,
                parameters=parameters,
                notes=assumption(parameters, joints),
                load=load,
                transmissions=transmissions,
                springs=self._springs(),
                couplings=couplings,
                motors=motors,
            )
        except DescriptionError as error:
            if error.file:
                raise
            self.fail(("joints",), f"a robot ({error})", shown=None)

    def _each(self, field: str) -> list[Keys]:
        """Return the keys of all tables in a list, or [] if the list is missing."""
        value = self.table.get(field, [])
        if not isinstance(value, list) or len(value) > MAX_JOINTS:
            self.fail((field,), f"a list of at most {MAX_JOINTS} {field}")
        return [(field, k) for k in range(len(value))]

    def _transmission(self, keys: Keys) -> Transmission:
        self.check_fields(keys, self.table_at(keys), TRANSMISSION_FIELDS)
        has_gain = self.at((*keys, "gain")) is not None
        gain = self.number((*keys, "gain"), "ratio") if has_gain else sp.S.One
        sin1, cos1, sin2, cos2 = (self.number((*keys, name), "angle") for name in _WAVES)
        waves = sin1, cos1, sin2, cos2
        try:
            return Transmission(self.name((*keys, "coordinate")), gain, waves)
        except DescriptionError as error:
            if error.file:
                raise
            self.fail((*keys, "gain"), f"an invertible drive model ({error})", shown=None)

    def load(self) -> Load | None:
        """Read the link masses, and the gravity vector in the base frame."""
        masses = tuple(map(self._mass, self._each("masses")))
        if "gravity" in self.table and not masses and "springs" not in self.table:
            self.fail(("gravity",), "[[masses]] for the gravity vector")
        return Load(masses, *self._gravity()) if masses else None

    def _springs(self) -> Springs | None:
        """Read the springs of joints, and the masses that load them."""
        springs = tuple(map(self._spring, self._each("springs")))
        return Springs(springs, *self._gravity()) if springs else None

    def _gravity(self) -> tuple[Vector, ...]:
        """Read the gravity vector. The default vector is used if the file has none."""
        return (self.vector(("gravity",), "ratio"),) if "gravity" in self.table else ()

    def _spring(self, keys: Keys) -> Spring:
        self.check_fields(keys, self.table_at(keys), SPRING_FIELDS)
        return Spring(
            coordinate=self.name((*keys, "coordinate")),
            compliance=self.literal((*keys, "compliance"), 0),
            axis=self.vector((*keys, "axis"), "ratio"),
            point=self.vector((*keys, "point"), "length"),
            mass=self.literal((*keys, "mass"), 0),
            center=self.vector((*keys, "center"), "length"),
        )

    def _mass(self, keys: Keys) -> PointMass:
        table = self.table_at(keys)
        self.check_fields(keys, table, ("link", "mass", "at"))
        if "mass" not in table:
            self.fail((*keys, "mass"), "a mass in kilograms")
        mass = self.number((*keys, "mass"), "mass")
        if self.at_defaults(mass) < 0:
            self.fail((*keys, "mass"), "a mass of at least 0")
        return PointMass(self.name((*keys, "link")), mass, self.vector((*keys, "at"), "length"))

    def _frame(self, which: str, default: str) -> tuple[Placement, str]:
        table = self.table_at((which,), {})
        self.check_fields((which,), table, ("name", "xyz", "rpy"))
        return self._pose((which,)), self._frame_name(which, default)

    def _frame_name(self, which: str, default: str) -> str:
        name = self.string((which, "name"), default)
        if not FRAME.fullmatch(name):
            self.fail((which, "name"), "letters, digits and _")
        return name

    def _pose(self, keys: Keys) -> Placement:
        xyz = self.vector((*keys, "xyz"), "length")
        rpy = self.vector((*keys, "rpy"), "angle")
        return from_xyz_rpy(xyz, rpy)

    def _joint_count(self) -> int:
        joints = self.table.get("joints")
        if not isinstance(joints, list) or not 1 <= len(joints) <= MAX_JOINTS:
            self.fail(("joints",), f"a list of 1 to {MAX_JOINTS} joints")
        return len(joints)

    def _joints(self) -> tuple[Joint, ...]:
        read = tuple(self._joint(k) for k in range(self._joint_count()))
        if all(joint.kind == "fixed" for joint in read):
            self.fail(("joints",), "a joint with its own coordinate", None)
        return read

    def joint_type(self, keys: Keys, kinds: Iterable[Word]) -> Word:
        """Read the type of a joint."""
        series = IN_SERIES.get(str(self.at(keys)))
        if series is not None:
            self.fail(keys, f"one of {listed(kinds)} (this joint consists of {series})")
        return self.option(keys, kinds, "revolute")

    def _joint(self, k: int) -> Joint:
        keys: Keys = ("joints", k)
        table = self.table_at(keys)
        kind = self.joint_type((*keys, "type"), KINDS)
        convention = self._convention(keys, table)
        names = [field.name for field in convention.fields]
        self.check_fields(keys, table, (*self.joint_fields, *names))
        given = self._given(keys, table, convention, kind)
        try:
            before, after = convention(kind, **given)
        except DescriptionError as error:
            self._fail_of_convention(keys, convention, error)
        return Joint(
            name=self._new((*keys, "name"), f"joint{k + 1}"),
            kind=kind,
            before=before,
            after=after,
            link=self._new((*keys, "link"), f"link{k + 1}", "link"),
            limits=self.limits((*keys, "limits"), kind),
            pitch=self._pitch(keys, kind),
            direction=int(self.option((*keys, "direction"), ("1", "-1"), "1")),
            convention=convention,
            given=convention.scalars(given),
            assumed=self.assumed(keys, ("limits", "pitch", *names)),
        )

    def _new(self, keys: Keys, default: str | None = None, what: str = "name") -> str:
        """Read a name. Each name must be unique in the file."""
        name = self.name(keys, default)
        first = self._taken.setdefault((what, name), keys)
        if first != keys:
            self.fail(keys, f"a {what} other than the {what} of {dotted(first[:2])}", name)
        return name

    def _convention(self, keys: Keys, table: Mapping[str, object]) -> Convention:
        """Return the convention of a joint.

        A joint without its own convention has the convention of the file.
        """
        at: Keys = (*keys, "convention") if "convention" in table else ("convention",)
        words = self.of_lines if len(at) == 1 else {}
        chosen = self.option(at, (*self._conventions, *words), "")
        return words.get(chosen) or self._conventions[chosen]

    def _given(
        self, keys: Keys, table: Mapping[str, object], convention: Convention, kind: JointKind
    ) -> dict[str, sp.Expr | Vector]:
        """Read the convention fields of a joint."""
        given = {
            field.name: self._value((*keys, field.name), field.kind) for field in convention.fields
        }
        for field in convention.fields:
            if field.name not in table:
                if field.needed_to and kind != "fixed":
                    self.fail((*keys, field.name), field.needed_to)
                given[field.name] = field.value({})
        return given

    def _fail_of_convention(
        self, keys: Keys, convention: Convention, error: DescriptionError
    ) -> NoReturn:
        """Raise an error for field values at which the convention defines no joint placement."""
        for field in convention.fields:
            if field.kind == "direction":
                self.fail((*keys, field.name), f"a direction: {error}")
        self.fail(keys, f"a joint of convention {convention.name!r} ({error})", shown=None)

    def _pitch(self, keys: Keys, kind: JointKind) -> sp.Expr:
        keys = (*keys, "pitch")
        if kind == "helical" and self.at(keys) is None:
            self.fail(keys, "the advance per radian of a helical joint")
        if kind != "helical" and self.at(keys) is not None:
            self.fail(keys, f"no pitch for a {kind} joint")
        return self.number(keys, "length") if kind == "helical" else sp.Integer(0)

    def _value(self, keys: Keys, kind: FieldKind) -> sp.Expr | Vector:
        match kind:
            case "length" | "angle":
                return self.number(keys, kind)
            case "lengths":
                return self.vector(keys, "length")
            case "angles":
                return self.vector(keys, "angle")
            case "direction":
                return self.vector(keys, "ratio")
