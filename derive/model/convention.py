"""A modeling convention as an object: joint fields, placements and printed form.

A robot file uses the fields, the compiler uses the placements, and the article prints one table
column per field. The conventions of chasles are listed in
:data:`chasles.derive.description.conventions.CONVENTIONS`. Custom conventions are objects of the
same class.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Literal

import mpmath
import sympy as sp

from .errors import DescriptionError
from .exact import exact, exact_vector
from .kinds import JointKind
from .placements import Placement, Rotation, Translation, Vector, filled

FieldKind = Literal["length", "angle", "lengths", "angles", "direction"]
"""A scalar (meter or radian), or a vector of lengths, angles, or a direction (unitless)."""
Placements = tuple[Placement, Placement]
"""The placements before and after a joint's motion, see :class:`chasles.derive.Joint`."""
Numbers = tuple[mpmath.mpf, mpmath.mpf, mpmath.mpf]
"""Vector components with :data:`~chasles.derive.model.tolerances.EVALUATION_DIGITS` digits."""
_SCALARS = ("length", "angle")
_AXES = "xyz"


@dataclass(frozen=True)
class Field:
    """A field that describes a joint.

    Attributes:
        name: Name in robot files.
        kind: Kind of the value, which determines its unit.
        headings: LaTeX of the vector components in table headings; a scalar uses its name.
        default: Value if a file omits the field, or None for zero.
        needed_to: Meaning of a field that moving joints require, for the error message; empty for
            optional fields.
        is_of_motion: Whether the field describes the joint's motion. Fixed joints ignore the fields
            that describe a motion.
    """

    name: str
    kind: FieldKind
    headings: tuple[str, ...] = ()
    default: Vector | None = None
    needed_to: str = ""
    is_of_motion: bool = False

    @property
    def is_vector(self) -> bool:
        """Whether the field is a vector with three components."""
        return self.kind not in _SCALARS

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the scalars in the field: the name of the field, or ``<name>_x`` and so on."""
        return tuple(f"{self.name}_{axis}" for axis in _AXES) if self.is_vector else (self.name,)

    def value(self, given: Mapping[str, object]) -> sp.Expr | Vector:
        """Returns the exact value of the field, or its default (meter, radian or 1)."""
        if self.name not in given:
            return self.default or ((sp.S.Zero,) * 3 if self.is_vector else sp.S.Zero)
        value = given[self.name]
        return exact_vector(value) if self.is_vector else exact(value)


@dataclass(frozen=True)
class AxisLine:
    """The axis of a joint, expressed in a frame whose z axis is the previous joint axis.

    Attributes:
        direction: The unit direction vector.
        point: A point on the axis (meter).
    """

    direction: Numbers
    point: Numbers


@dataclass(frozen=True)
class Fitted:
    """An axis in the fields of a convention, relative to a frame on the previous axis.

    Attributes:
        turn: Rotation about the previous axis (radian).
        shift: Translation along the previous axis (meter).
        values: Values of the fields by name; other fields are zero.
    """

    turn: sp.Expr
    shift: sp.Expr
    values: Mapping[str, sp.Expr | Vector]


@dataclass(frozen=True, repr=False)
class Convention:
    """A convention that describes a joint and its child link.

    A convention is callable, ``before, after = dh("revolute", a="0.3", d="d1")``. The call converts
    field values into the placements of a :class:`chasles.derive.Joint`.

    Attributes:
        name: Name in robot files.
        fields: The fields, in the order in which they are read.
        place: Function that converts the joint's kind and all fields, keyed by name, to the
            placements.
        source: Publication in which the convention is defined.
        words: The convention's name in a sentence of the article. Without a ``transform``, a phrase
            that lists the fields.
        transform: The link transform as a product of elementary motions in the field symbols,
            without the joint's motion; empty if no such product exists.
        turning: Field to which a revolute joint adds its variable; the value is empty if there is
            no such field.
        sliding: Field to which a prismatic joint adds its variable; the value is empty if there is
            no such field.
        second_part: First field of the second table, if a single table is too wide.
        numbers: Function that returns, for a joint kind, the elementary motions whose values a
            calibration corrects. If None, the link transform is used.
        fit: Function that returns the fields for a joint's axis relative to the previous axis. The
            function returns None if the convention cannot represent the axis.
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
        """Returns the name, because the repr of a robot is hashed and must contain no address."""
        return repr(self.name)

    def __call__(self, kind: JointKind, **given: object) -> Placements:
        """Returns the placements before and after a joint's motion about or along z.

        Args:
            kind: Kind of the joint.
            given: Exact values of fields by name (meter, radian or 1); other fields use their
                defaults.

        Raises:
            DescriptionError: A name is not a field, a value is not exact, or a direction is zero or
                contains a parameter.
        """
        unknown = given.keys() - {field.name for field in self.fields}
        if unknown:
            known = ", ".join(field.name for field in self.fields)
            raise DescriptionError(
                f"convention {self.name!r} has no field {', '.join(sorted(unknown))};"
                f" its fields are {known}"
            )
        return self.place(kind, **{field.name: field.value(given) for field in self.fields})

    def scalars(self, given: Mapping[str, sp.Expr | Vector]) -> tuple[tuple[str, sp.Expr], ...]:
        """Returns the scalars of the printed table with their names; vectors are split."""
        scalars: list[tuple[str, sp.Expr]] = []
        for field in self.fields:
            value = given[field.name]
            values = value if isinstance(value, tuple) else (value,)
            scalars += zip(field.components, values, strict=True)
        return tuple(scalars)

    @property
    def columns(self) -> tuple[tuple[Field, str, str], ...]:
        """Columns of a printed table: the field, the name of the scalar, and its LaTeX.

        The columns have the order of the link transform, or of the fields if there is no transform.
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
        """Returns the field to which a joint adds its variable; empty if there is none."""
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
    """Returns a convention whose link transform is a product of elementary motions in its fields.

    Args:
        name: Name in robot files.
        fields: The fields.
        transform: The product, with symbols that have the names of the fields.
        source: Publication in which the convention is defined.
        words: The name of the convention in a sentence of the article.
        turning: Field to which a revolute joint adds its variable.
        sliding: Field to which a prismatic joint adds its variable. Without this field, a prismatic
            joint slides along the z axis of a revolute joint.
        fit: See :class:`Convention`.

    Raises:
        DescriptionError: The variable of a joint is not a rotation about z or a translation with a
            z component.
    """
    place = partial(_placed, transform, turning, sliding)
    convention = Convention(
        name, fields, place, source, words, transform, turning, sliding, fit=fit
    )
    for kind in ("revolute", "prismatic"):
        motions_before(transform, convention.variable(kind) or turning)
    return convention


def motions_before(transform: Placement, variable: str) -> int:
    """Returns the number of motions in a link transform before the motion of the joint itself.

    The joint motion comes after the factor with the joint variable, and after adjacent rotations
    about z and translations along z, which commute with the motion.
    """
    indices = [k for k, motion in enumerate(transform) if variable in map(str, _arguments(motion))]
    if not indices or not _is_along_z(transform[indices[0]], variable):
        raise DescriptionError(
            f"{variable!r} is neither a rotation about z nor a translation along z of the link"
        )
    count = indices[0] + 1
    while count < len(transform) and transform[count].is_along_z:
        count += 1
    return count


def _placed(
    transform: Placement, turning: str, sliding: str, kind: JointKind, **values: sp.Expr
) -> Placements:
    variable = (sliding or turning) if kind == "prismatic" else turning
    count = motions_before(transform, variable)
    exact_values = {sp.Symbol(name, real=True): value for name, value in values.items()}
    return filled(transform[:count], exact_values), filled(transform[count:], exact_values)


def _arguments(motion: Rotation | Translation) -> tuple[sp.Expr, ...]:
    """Returns the symbols of an elementary motion in the order of its axes."""
    if isinstance(motion, Rotation):
        return (motion.angle,)
    return tuple(component for component in motion.vector if component != 0)


def _is_along_z(motion: Rotation | Translation, variable: str) -> bool:
    if isinstance(motion, Rotation):
        return motion.axis == "z"
    return str(motion.vector[2]) == variable


def _position(order: list[str], name: str) -> int:
    return order.index(name) if name in order else len(order)
