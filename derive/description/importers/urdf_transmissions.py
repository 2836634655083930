"""Reads the transmissions of a URDF, which make joints linear functions of actuators.

The elements <transmission> of the URDF and of <ros2_control> follow the equations of ros2_control.
In the equations, a is an actuator position, j is a joint position, n is a mechanical reduction, and
offset is a joint offset.

A simple transmission has the equation ``j = a / n + offset``.

A differential has the equations ``j1 = (a1 / n_a1 + a2 / n_a2) / (2 n_j1) + offset1`` and
``j2 = (a1 / n_a1 - a2 / n_a2) / (2 n_j2) + offset2``.

A four-bar linkage transmission has the equations ``j1 = a1 / (n_j1 n_a1) + offset1`` and ``j2 = (a2
/ n_a2 - a1 / (n_j1 n_a1)) / n_j2 + offset2``.
"""

from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NoReturn

import sympy as sp
from lxml import etree

from ...model.coupling import Motor
from .identifiers import identifier

SIMPLE, DIFFERENTIAL, FOUR_BAR = (
    *("SimpleTransmission", "DifferentialTransmission"),
    "FourBarLinkageTransmission",
)
ACTUATORS: Mapping[str, int] = {SIMPLE: 1, DIFFERENTIAL: 2, FOUR_BAR: 2}
"""Number of actuators for each type of transmission. A transmission has as many joints as
actuators."""
REDUCTION_TAGS = ("mechanical_reduction", "mechanicalReduction")
"""Names of the XML element with the reduction, in <ros2_control> and in <robot>."""
Ratios = tuple[tuple[str, sp.Expr], ...]


@dataclass(frozen=True)
class DrivenJoints:
    """The joints that are moved by transmissions.

    Attributes:
        rows: Actuator ratios and offset of each joint, by the joint name in the file.
        motors: The actuators that are not joints of the chain.
        notes: Sentences that describe the transmissions.
    """

    rows: Mapping[str, tuple[Ratios, sp.Expr]]
    motors: tuple[Motor, ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class TransmissionReader:
    """Reads the transmissions of a file.

    Attributes:
        root: The element <robot>.
        number: Reads a number of an element. An error names the field.
        fail: Raises the error for a field of an element.
    """

    root: etree._Element
    number: Callable[[etree._Element, str, str], sp.Expr]
    fail: Callable[[etree._Element, str, object, str], NoReturn]

    def driven(self, joints: Sequence[str]) -> DrivenJoints:
        """Return the joints of a chain with transmissions.

        A simple transmission with reduction 1 and offset 0 has no effect.

        Args:
            joints: Names of the moving joints without mimic joints.

        Raises:
            DescriptionError: A reduction is 0 or not a number, or two transmissions share a joint
                or an actuator.
        """
        rows: dict[str, tuple[Ratios, sp.Expr]] = {}
        motors: list[str] = []
        notes: list[str] = []
        paths = ("transmission", "ros2_control/transmission")
        for element in (element for path in paths for element in self.root.iterfind(path)):
            parts, moved = list(_in_order(element, "actuator")), list(_in_order(element, "joint"))
            names = [str(joint.get("name")) for joint in moved]
            if not {*names} & {*joints}:
                continue
            kind, title = _kind(element), f"transmission {element.get('name', '')}"
            found = self._rows(kind, parts, moved)
            outside = ", ".join(name for name in names if name not in joints)
            if found is None:
                ends = f"{len(parts)} actuators, {len(moved)} joints"
                notes.append(f"{title} has no effect: {kind or 'no type'}, {ends}")
            elif found and outside:
                expected = "not a joint of the chain with a separate coordinate"
                notes.append(f"{title} has no effect: {outside} is {expected}")
            elif found:
                actuators = [identifier(str(part.get("name"))) for part in parts]
                others = (identifier(name) for name in joints if name not in names)
                expected = "a name that no other joint and no other transmission has"
                self._check(parts, {*motors, *others}, expected)
                self._check(moved, {*map(identifier, rows)}, "a joint without another transmission")
                motors += actuators
                rows |= zip(names, found, strict=True)
                notes.append(f"{title}: q has {', '.join(actuators)} for {', '.join(names)}")
        own = {identifier(joint) for joint in rows}
        free = tuple(Motor(name) for name in motors if name not in own)
        return DrivenJoints(rows, free, tuple(notes))

    def _check(self, parts: Sequence[etree._Element], taken: Container[str], expected: str) -> None:
        """Raise an error if the name of a part is in ``taken`` or occurs twice."""
        seen: set[str] = set()
        for part in parts:
            name = identifier(str(part.get("name")))
            if name in taken or name in seen:
                self.fail(part, "name", part.get("name"), expected)
            seen.add(name)

    def _rows(
        self, kind: str, parts: Sequence[etree._Element], joints: Sequence[etree._Element]
    ) -> list[tuple[Ratios, sp.Expr]] | None:
        """Return the equations of the joints of a transmission.

        The result is None for an unknown type of transmission. The result is empty if actuator and
        joint have the same position (ratio 1).
        """
        if not len(parts) == len(joints) == ACTUATORS.get(kind):
            return None
        n_a = [self._reduction(part) for part in parts]
        n_j = [self._reduction(part) for part in joints]
        offsets = [self._number(part, ("offset",), "0") for part in joints]
        if kind == SIMPLE:
            ratios = [[1 / (n_a[0] * n_j[0])]]
        elif kind == DIFFERENTIAL:
            a, b = (1 / (2 * n) for n in n_a)
            ratios = [[a / n_j[0], b / n_j[0]], [a / n_j[1], -b / n_j[1]]]
        else:
            first = 1 / (n_j[0] * n_a[0])
            ratios = [[first, sp.S.Zero], [-first / n_j[1], 1 / (n_a[1] * n_j[1])]]
        if ratios == [[1]] and offsets == [0]:
            return []
        names = [identifier(self._name(part)) for part in parts]
        return [
            (tuple(item for item in zip(names, row, strict=True) if item[1] != 0), offset)
            for row, offset in zip(ratios, offsets, strict=True)
        ]

    def _reduction(self, part: etree._Element) -> sp.Expr:
        found = self._number(part, REDUCTION_TAGS, "1")
        if found == 0:
            self.fail(part, REDUCTION_TAGS[0], 0, "a nonzero ratio of actuator and joint motion")
        return found

    def _number(self, part: etree._Element, tags: Sequence[str], default: str) -> sp.Expr:
        texts = (part.findtext(tag) for tag in tags)
        text = next((text for text in texts if text and text.strip()), default)
        return self.number(part, tags[0], text)

    def _name(self, part: etree._Element) -> str:
        if not part.get("name"):
            self.fail(part, "name", part.get("name"), 'name="..."')
        return str(part.get("name"))


def _kind(element: etree._Element) -> str:
    texts = element.findtext("plugin"), element.findtext("type"), element.get("type")
    return next((text.strip().rpartition("/")[2] for text in texts if text), "")


def _in_order(element: etree._Element, tag: str) -> Iterator[etree._Element]:
    """Yield the actuators or joints of a transmission.

    If each actuator or joint has a role, the elements are sorted by role.
    """
    parts = element.findall(tag)
    roles = [(part.get("role") or part.findtext("role") or "").strip() for part in parts]
    order = sorted(range(len(parts)), key=lambda k: roles[k]) if all(roles) else range(len(parts))
    return (parts[k] for k in order)
