"""Writes the couplings of a serial robot as mimic joints and transmissions of ros2_control.

Joints that depend on the same coordinates form a group. A group of joints that depend on one
coordinate becomes an ordinary joint or a simple transmission. A group of joints that depend on two
coordinates becomes a differential or a four-bar linkage. The remaining joints of a group of coupled
joints mimic another joint of the group.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations

import sympy as sp
from lxml import etree

from ..description.importers.urdf_transmissions import DIFFERENTIAL, FOUR_BAR, SIMPLE
from ..model.errors import InputValueError
from ..model.robot import SerialRobot
from .number_text import nearest

Row = tuple[tuple[sp.Expr, ...], sp.Expr]
"""Coefficients of the equation of a coupled joint: the coupling ratio of each coordinate, and the
offset."""


@dataclass(frozen=True)
class Mimic:
    """The equation of a mimic joint: value = multiplier * leader + offset."""

    leader: str
    multiplier: sp.Expr
    offset: sp.Expr


@dataclass(frozen=True)
class Gears:
    """A transmission with its gear reductions.

    Attributes:
        kind: The type of the transmission in ros2_control.
        actuators: Names and reductions of the actuators.
        joints: Names, reductions and offsets of the joints.
    """

    kind: str
    actuators: tuple[tuple[str, sp.Expr], ...]
    joints: tuple[tuple[str, sp.Expr, sp.Expr], ...]


def urdf_drives(robot: SerialRobot) -> tuple[dict[str, Mimic], tuple[Gears, ...]]:
    """Return the mimic joints by name, and the transmissions of a robot.

    Raises:
        InputValueError: A group of coupled joints is neither a differential, nor a four-bar
            linkage, nor a set of joints that follow one coordinate.
    """
    mimics: dict[str, Mimic] = {}
    gears = []
    groups = list(_groups(robot))
    moved = {name for _, rows in groups for name in rows}
    groups += [([], {j.name: ((), sp.S.Zero)}) for j in robot.moving if j.name not in moved]
    for coordinates, rows in groups:
        found = _group(coordinates, rows) if len(coordinates) in (1, 2) else None
        if found is None:
            raise InputValueError(
                f"{robot.name}: URDF cannot express the coupling of {', '.join(rows)}; in URDF, "
                "a joint mimics one joint, and a transmission is simple, differential or a "
                "four-bar linkage"
            )
        leaders, transmission = found
        gears += [transmission] if transmission else []
        mimics |= leaders
    return mimics, tuple(gears)


def _groups(robot: SerialRobot) -> Iterator[tuple[list[str], dict[str, Row]]]:
    own = robot.linear_map
    names = [joint.name for joint in robot.moving]
    left = list(range(len(own.coordinates)))
    while left:
        columns, joints = [left[0]], set[int]()
        while True:
            joints = {j for j in range(own.C.rows) if any(own.C[j, k] != 0 for k in columns)}
            wider = [k for k in left if any(own.C[j, k] != 0 for j in joints)]
            if wider == columns:
                break
            columns = wider
        left = [k for k in left if k not in columns]
        rows = {names[j]: (tuple(own.C[j, k] for k in columns), own.c[j]) for j in sorted(joints)}
        yield [own.coordinates[k] for k in columns], rows


def _group(
    coordinates: Sequence[str], rows: Mapping[str, Row]
) -> tuple[dict[str, Mimic], Gears | None] | None:
    """Return mimic joints and transmission of a group, or None if URDF cannot express the group."""
    own = coordinates[0]
    if len(coordinates) == 1 and rows.get(own) == ((1,), 0):
        return _followers(rows, [own]), None
    for chosen in permutations(rows, len(coordinates)):
        gears = _gears(coordinates, {name: rows[name] for name in chosen})
        if gears is None:
            continue
        mimics = _followers(rows, chosen)
        if len(mimics) + len(chosen) == len(rows):
            return mimics, gears
    return None


def _followers(rows: Mapping[str, Row], leaders: Sequence[str]) -> dict[str, Mimic]:
    found = {}
    for joint in (name for name in rows if name not in leaders):
        ratios, offset = rows[joint]
        for leader in leaders:
            its, shift = rows[leader]
            k = next(k for k, ratio in enumerate(its) if ratio != 0)
            multiplier = ratios[k] / its[k]
            if ratios == tuple(multiplier * ratio for ratio in its):
                found[joint] = Mimic(leader, multiplier, offset - multiplier * shift)
                break
    return found


def _gears(coordinates: Sequence[str], rows: Mapping[str, Row]) -> Gears | None:
    """Return the transmission with the joint equations ``rows``, or None if none exists."""
    names, offsets = list(rows), [offset for _, offset in rows.values()]
    ratios = [row for row, _ in rows.values()]
    one = sp.S.One
    if len(coordinates) == 1:
        return Gears(SIMPLE, ((coordinates[0], one),), ((names[0], 1 / ratios[0][0], offsets[0]),))
    for first, second in ((0, 1), (1, 0)):
        (a, b), (c, d) = ([row[first], row[second]] for row in ratios)
        order = coordinates[first], coordinates[second]
        if b == 0 and a != 0 and c != 0 and d != 0:
            n = -a / c
            actuators = ((order[0], 1 / a), (order[1], 1 / (d * n)))
            joints = ((names[0], one, offsets[0]), (names[1], n, offsets[1]))
            return Gears(FOUR_BAR, actuators, joints)
        if a * d == -b * c != 0:
            joints = ((names[0], 1 / (2 * a), offsets[0]), (names[1], 1 / (2 * c), offsets[1]))
            return Gears(DIFFERENTIAL, ((order[0], one), (order[1], a / b)), joints)
    return None


def write_gears(root: etree._Element, name: str, gears: Sequence[Gears]) -> None:
    """Append an element <ros2_control> that contains the transmissions, for simulated hardware."""
    system = etree.SubElement(root, "ros2_control", name=name, type="system")
    hardware = etree.SubElement(system, "hardware")
    etree.SubElement(hardware, "plugin").text = "mock_components/GenericSystem"
    for joint in (joint for item in gears for joint, _, _ in item.joints):
        own = etree.SubElement(system, "joint", name=joint)
        etree.SubElement(own, "command_interface", name="position")
        etree.SubElement(own, "state_interface", name="position")
    for k, item in enumerate(gears, 1):
        element = etree.SubElement(system, "transmission", name=f"transmission{k}")
        etree.SubElement(element, "plugin").text = f"transmission_interface/{item.kind}"
        for j, (actuator, reduction) in enumerate(item.actuators, 1):
            part = etree.SubElement(element, "actuator", name=actuator, role=f"actuator{j}")
            etree.SubElement(part, "mechanical_reduction").text = nearest(reduction)
        for j, (joint, reduction, offset) in enumerate(item.joints, 1):
            part = etree.SubElement(element, "joint", name=joint, role=f"joint{j}")
            etree.SubElement(part, "mechanical_reduction").text = nearest(reduction)
            etree.SubElement(part, "offset").text = nearest(offset)
