"""Modeling conventions define the fields of a joint, its placements and its printed form.

Robot files contain the fields of a joint. The placements of the joint follow from its fields. The
LaTeX article prints a table with one column per field.
``chasles.derive.description.conventions.CONVENTIONS`` lists the conventions of chasles. A custom
convention is another object of the same class.
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
"""A scalar (meter or radian), a vector of lengths (meter) or of angles (radian), or a direction
(unitless)."""
Placements = tuple[Placement, Placement]
"""The placements before and after the motion of a joint, see ``chasles.derive.Joint``."""
Numbers = tuple[mpmath.mpf, mpmath.mpf, mpmath.mpf]
"""Vector components with ``EVALUATION_DIGITS`` digits."""
_SCALARS = ("length", "angle")
_AXES = "xyz"


@dataclass(frozen=True)
class Field:
    """A field of a convention.

    Attributes:
        name: Name in robot files.
        kind: Kind of the value, which determines its unit.
        headings: LaTeX of the vector components in table headings.
        default: Value of an omitted field. If `default` is None, an omitted field is zero.
        needed_to: Phrase of the error message for a moving joint that omits this field. Empty for
            optional fields.
        is_of_motion: Whether the field describes the joint motion, so that fixed joints ignore it.
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
        """Return the exact value of the field, or its default (meter, radian or 1)."""
        if self.name not in given:
            return self.default or ((sp.S.Zero,) * 3 if self.is_vector else sp.S.Zero)
        value = given[self.name]
        return exact_vector(value) if self.is_vector else exact(value)


@dataclass(frozen=True)
class AxisLine:
    """The axis of a joint, in a frame whose z axis is the previous joint axis.

    Attributes:
        direction: The unit vector along the axis.
        point: A point on the axis (meter).
    """

    direction: Numbers
    point: Numbers


@dataclass(frozen=True)
class Fitted:
    """The parameters of a convention for a joint axis, relative to a frame on the previous axis.

    Attributes:
        turn: Rotation about the previous axis (radian).
        shift: Translation along the previous axis (meter).
        values: Values of the fields by name. Fields without a value are zero.
    """

    turn: sp.Expr
    shift: sp.Expr
    values: Mapping[str, sp.Expr | Vector]


@dataclass(frozen=True, repr=False)
class Convention:
    """A convention that describes a joint and its child link.

    A convention is callable, as in ``before, after = dh("revolute", a="0.3", d="d1")``. The call
    takes the field values, and returns the placements before and after the joint motion. These
    placements are arguments of ``chasles.derive.Joint``.

    Attributes:
        name: Name in robot files.
        fields: The fields, in the order in which they are read.
        place: Function that returns the placements of a joint. Its arguments are the joint's kind
            and the values of all fields by name.
        source: Publication that defines the convention.
        words: Name of the convention in a sentence of the LaTeX article. If ``transform`` is empty,
            ``words`` also explains the fields.
        transform: The link transform, as a product of elementary motions. Each motion contains
            symbols of ``fields``. The motion of the joint is not a factor of this product. The
            tuple is empty if the link transform cannot be written as such a product.
        turning: Field to which the angle of a revolute joint is added, or "".
        sliding: Field to which the displacement of a prismatic joint is added, or "".
        second_part: If the printed joint table is too wide, this field and the fields after it are
            printed in a second table.
        numbers: Function of the joint type. The function returns those elementary motions of the
            link transform whose parameters a calibration corrects. By default, a calibration
            corrects the parameters of all elementary motions.
        fit: Function that returns the fields for the axis of a joint relative to the previous axis.
            The value is None if the convention cannot represent the axis.
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
        """Return the name.

        The repr of a robot is hashed, so it must not contain an address.
        """
        return repr(self.name)

    def __call__(self, kind: JointKind, **given: object) -> Placements:
        """Return the placements before and after the motion of a joint about or along its z axis.

        Args:
            kind: Kind of the joint.
            given: Exact values of fields by name (meter, radian or 1). Omitted fields have their
                default values.

        Raises:
            DescriptionError: A given field does not exist, a value is not exact, or a direction is
                zero or contains a parameter.
        """
        unknown = given.keys() - {field.name for field in self.fields}
        if unknown:
            known = ", ".join(field.name for field in self.fields)
            raise DescriptionError(
                f"convention {self.name!r} has no field {', '.join(sorted(unknown))};"
                f" fields: {known}"
            )
        return self.place(kind, **{field.name: field.value(given) for field in self.fields})

    def scalars(self, given: Mapping[str, sp.Expr | Vector]) -> tuple[tuple[str, sp.Expr], ...]:
        """Return the names and values of the scalars in the printed table."""
        scalars: list[tuple[str, sp.Expr]] = []
        for field in self.fields:
            value = given[field.name]
            values = value if isinstance(value, tuple) else (value,)
            scalars += zip(field.components, values, strict=True)
        return tuple(scalars)

    @property
    def columns(self) -> tuple[tuple[Field, str, str], ...]:
        """Columns of a printed table as tuples (field, name of the scalar, LaTeX).

        The columns have the order of the link transform. If the convention has no link transform,
        the columns have the order of the fields.
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
        """Return the name of the field that contains the variable of a joint, or ""."""
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
    """Return a convention whose link transform is a product of motions.

    Args:
        name: Name in robot files.
        fields: The fields.
        transform: The product of motions. Each symbol in the motions has the name of its field.
        source: Publication that defines the convention.
        words: The name of the convention in a sentence of the LaTeX article.
        turning: Field to which a revolute joint adds its variable.
        sliding: Field to which a prismatic joint adds its variable. If ``sliding`` is empty, a
            prismatic joint moves along the z axis of the motion that contains the field
            ``turning``.
        fit: See ``Convention``.

    Raises:
        DescriptionError: The variable of a joint is neither a rotation about z nor a translation
            along z.
    """
    place = partial(_placed, transform, turning, sliding)
    convention = Convention(
        name, fields, place, source, words, transform, turning, sliding, fit=fit
    )
    for kind in ("revolute", "prismatic"):
        motions_before(transform, convention.variable(kind) or turning)
    return convention


def motions_before(transform: Placement, variable: str) -> int:
    """Return the number of motions in a link transform before the joint motion.

    Later rotations about z and translations along z also come before the joint motion, because they
    commute with this motion.
    """
    indices = [k for k, motion in enumerate(transform) if variable in map(str, _arguments(motion))]
    if not indices or not _is_along_z(transform[indices[0]], variable):
        raise DescriptionError(
            f"{variable!r}: expected a rotation about z or a translation along z of the link"
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
    """Return the symbols of a motion in the order of its axes."""
    if isinstance(motion, Rotation):
        return (motion.angle,)
    return tuple(component for component in motion.vector if component != 0)


def _is_along_z(motion: Rotation | Translation, variable: str) -> bool:
    if isinstance(motion, Rotation):
        return motion.axis == "z"
    return str(motion.vector[2]) == variable


def _position(order: list[str], name: str) -> int:
    return order.index(name) if name in order else len(order)
