"""A modelling convention as one object: fields of a joint, their placements, their printed form.

A robot file names the fields, the compiler uses the placements alone, and the article of a robot
prints a table with one column a field and the link transform. The shipped conventions are in
:data:`chasles.derive.description.conventions.CONVENTIONS`; another one is an object like them,
handed to :func:`chasles.derive.read`.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Literal

import mpmath
import sympy as sp

from .errors import RobotError
from .exact import exact, exact_vector
from .kinds import JointKind
from .placements import Placement, Rotation, Translation, Vector, rotation, translation

FieldKind = Literal["length", "angle", "lengths", "angles", "direction"]
"""A scalar (metre or radian), or a vector of lengths, of angles, or of a direction (unitless)."""
Placements = tuple[Placement, Placement]
"""The placements before and after a joint's motion, see :class:`chasles.derive.Joint`."""
Numbers = tuple[mpmath.mpf, mpmath.mpf, mpmath.mpf]
"""Components of a vector to :data:`~chasles.derive.model.tolerances.EVALUATION_DIGITS` digits."""
_SCALARS = ("length", "angle")
_AXES = "xyz"


@dataclass(frozen=True)
class Field:
    """A field of a joint.

    Attributes:
        name: Name in robot files.
        kind: Kind of the value, which decides its unit.
        headings: LaTeX of the components of a vector, over the columns of a printed table; a scalar
            is printed by its name.
        default: Value where a file leaves the field out: zero, or this.
        needed_to: Meaning of a field that a moving joint must give, for the error where it is
            missing; empty where the field may be left out.
        is_of_motion: Whether the field describes the motion, so that fixed joints ignore it.
    """

    name: str
    kind: FieldKind
    headings: tuple[str, ...] = ()
    default: Vector | None = None
    needed_to: str = ""
    is_of_motion: bool = False

    @property
    def is_vector(self) -> bool:
        """Whether the field holds three components."""
        return self.kind not in _SCALARS

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the scalars that the field holds: its own, or ``<name>_x`` and so on."""
        return tuple(f"{self.name}_{axis}" for axis in _AXES) if self.is_vector else (self.name,)

    def value(self, given: Mapping[str, object]) -> sp.Expr | Vector:
        """The exact given value of the field, or its default (metre, radian or 1)."""
        if self.name not in given:
            return self.default or ((sp.S.Zero,) * 3 if self.is_vector else sp.S.Zero)
        value = given[self.name]
        return exact_vector(value) if self.is_vector else exact(value)


@dataclass(frozen=True)
class AxisLine:
    """The axis of a joint, seen from the axis before it: the z axis of the frame of reference.

    Attributes:
        direction: Its direction, a unit vector.
        point: A point on it (metre).
    """

    direction: Numbers
    point: Numbers


@dataclass(frozen=True)
class Fitted:
    """An axis in a convention: Rz(turn) Tz(shift), which is the axis before's, then the fields.

    Attributes:
        turn: Turn about the axis before (radian).
        shift: Shift along it (metre).
        values: Values of the fields by name; the others are zero.
    """

    turn: sp.Expr
    shift: sp.Expr
    values: Mapping[str, sp.Expr | Vector]


@dataclass(frozen=True, repr=False)
class Convention:
    """A way to describe a joint and the link that it carries.

    A convention is called like a function, ``before, after = dh("revolute", a="0.3", d="d1")``: it
    turns values of its fields into the placements of a :class:`chasles.derive.Joint`.

    Attributes:
        name: Name in robot files.
        fields: The fields, in the order in which they are read.
        place: Function of the joint's kind and of every field, by name, to the placements.
        source: Publication that defines the convention.
        words: Its name in a sentence of the article; where there is no ``transform``, words for the
            fields, to which "and their variables" is added.
        transform: The link transform as a product of elementary motions in the fields' symbols, the
            joint's motion left out; empty where the convention is no such product.
        turning: Field to which a turning joint adds its variable; empty where none does.
        sliding: Field to which a sliding joint adds its variable; empty where none does.
        second_part: Field with which the second part of a table begins that is too wide.
        numbers: Function of a joint's kind to the product of elementary motions in the numbers that
            a calibration corrects, where this is not the link transform.
        fit: Function of a joint's axis, as the axis before sees it, to the fields that place it;
            its result is None where the convention has no values for the axis.
    """

    name: str
    fields: tuple[Field, ...]
    place: Callable[..., Placements]
    source: str
    words: str
    transform: Placement = ()
    turning: str = ""
    sliding: str = ""
    second_part: str = ""
    numbers: Callable[[JointKind], Placement] | None = None
    fit: Callable[[AxisLine], Fitted | None] | None = None

    def __repr__(self) -> str:
        """The name: a robot's repr is hashed, and a function's repr differs in each process."""
        return repr(self.name)

    def __call__(self, kind: JointKind, **given: object) -> Placements:
        """The placements before and after a joint's motion about or along z.

        Args:
            kind: Kind of the joint.
            given: Values of fields by name (metre, radian or 1), exact; the others have their
                defaults.

        Raises:
            RobotError: A name is no field, a value is not exact, or a direction is zero or contains
                a parameter.
        """
        unknown = given.keys() - {field.name for field in self.fields}
        if unknown:
            known = ", ".join(field.name for field in self.fields)
            raise RobotError(
                f"convention {self.name!r} has no field {', '.join(sorted(unknown))};"
                f" its fields are {known}"
            )
        return self.place(kind, **{field.name: field.value(given) for field in self.fields})

    def scalars(self, given: Mapping[str, sp.Expr | Vector]) -> tuple[tuple[str, sp.Expr], ...]:
        """Values of fields as named scalars, vectors by component, for the printed table."""
        scalars: list[tuple[str, sp.Expr]] = []
        for field in self.fields:
            value = given[field.name]
            values = value if isinstance(value, tuple) else (value,)
            scalars += zip(field.components, values, strict=True)
        return tuple(scalars)

    @property
    def columns(self) -> tuple[tuple[Field, str, str], ...]:
        """Columns of a printed table: the field, the scalar's name, and its LaTeX or ''.

        The columns are in the order of the link transform; without one, of the fields.
        """
        order = [str(symbol) for motion in self.transform for symbol in _arguments(motion)]
        fields = sorted(self.fields, key=lambda field: _position(order, field.name))
        return tuple(
            (field, component, heading)
            for field in fields
            for component, heading in zip(
                field.components, field.headings or ("",) * len(field.components), strict=True
            )
        )

    def variable(self, kind: JointKind) -> str:
        """The field to which a joint of a kind adds its variable; empty where none does."""
        return {"fixed": "", "prismatic": self.sliding}.get(kind, self.turning)


def of_transform(
    name: str,
    fields: tuple[Field, ...],
    transform: Placement,
    *,
    source: str,
    words: str,
    turning: str = "",
    sliding: str = "",
    fit: Callable[[AxisLine], Fitted | None] | None = None,
) -> Convention:
    """A convention whose link transform is a product of elementary motions in its fields.

    Args:
        name: Name in robot files.
        fields: The fields.
        transform: The product, in symbols called as the fields.
        source: Publication that defines the convention.
        words: Its name in a sentence of the article.
        turning: Field to which a turning joint adds its variable.
        sliding: Field to which a sliding joint adds its variable; a joint without one slides along
            the z axis that it would turn about.
        fit: See :class:`Convention`.

    Raises:
        RobotError: The variable of a joint is no turn about z or no shift with a z component.
    """
    place = partial(_placed, transform, turning, sliding)
    convention = Convention(
        name, fields, place, source, words, transform, turning, sliding, fit=fit
    )
    for kind in ("revolute", "prismatic"):
        motions_before(transform, convention.variable(kind) or turning)
    return convention


def motions_before(transform: Placement, variable: str) -> int:
    """The number of motions in a link transform before the joint's own motion about or along z.

    The joint moves right after the factor that holds its variable, and after the turns about z and
    shifts along z next to that, which commute with it.
    """
    held = [k for k, motion in enumerate(transform) if variable in map(str, _arguments(motion))]
    if not held or not _is_along_z(transform[held[0]], variable):
        raise RobotError(f"{variable!r} is neither a turn about z nor a shift along z of the link")
    count = held[0] + 1
    while count < len(transform) and _commutes_with_z(transform[count]):
        count += 1
    return count


def _placed(
    transform: Placement, turning: str, sliding: str, kind: JointKind, **values: sp.Expr
) -> Placements:
    variable = (sliding or turning) if kind == "prismatic" else turning
    count = motions_before(transform, variable)
    exact_values = {sp.Symbol(name, real=True): value for name, value in values.items()}
    return _filled(transform[:count], exact_values), _filled(transform[count:], exact_values)


def _filled(motions: Placement, values: Mapping[sp.Symbol, sp.Expr]) -> Placement:
    """Elementary motions with values for their symbols; those that become zero are left out."""
    filled: Placement = ()
    for motion in motions:
        if isinstance(motion, Rotation):
            filled += rotation(motion.axis, motion.angle.xreplace(values))
        else:
            filled += translation(*(component.xreplace(values) for component in motion.vector))
    return filled


def _arguments(motion: Rotation | Translation) -> tuple[sp.Expr, ...]:
    """The symbols of an elementary motion in the order of its axes."""
    if isinstance(motion, Rotation):
        return (motion.angle,)
    return tuple(component for component in motion.vector if component != 0)


def _is_along_z(motion: Rotation | Translation, variable: str) -> bool:
    if isinstance(motion, Rotation):
        return motion.axis == "z"
    return str(motion.vector[2]) == variable


def _commutes_with_z(motion: Rotation | Translation) -> bool:
    if isinstance(motion, Rotation):
        return motion.axis == "z"
    x, y, _ = motion.vector
    return bool(x == 0 and y == 0)


def _position(order: list[str], name: str) -> int:
    return order.index(name) if name in order else len(order)
