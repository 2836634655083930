"""Recognize the column headings of a measurement table, and assign a standard name to each.

The heading of a joint column is the coordinate name of the robot or a common joint name. Examples
of joint headings are q1, J1, joint_1, theta_1[deg], A1, Achse 1, rax_1, q[0] and the letters S L U
R B T. A column for the position x has the heading x, X_mm, px, pos_x, tcp.x or x_measured. If each
row contains several positions, their x columns have headings such as X1, x_1, P1_x, target_1_x,
SMR1.X, left_x and right_x. If each row contains two positions, the headings of the x columns may
also be x and x, or x and x.1. Columns of quaternions have headings such as qw, quat_w and
orientation.w. The columns q1 ... q4 or q0 ... q3 contain a quaternion if the joint columns have
other names. Columns of rotation vectors have headings such as rx, rot_x and rotvec_x. Roll, pitch
and yaw have the headings roll, pitch, yaw; w, p, r (FANUC); or c, b, a (KUKA). Columns of rotation
matrices have headings such as r11, R_1_1, T[0][0] and m00, or nx, ox and ax. A column of target
names has the heading target, marker, SMR, point or ball.

Units are written in brackets, after an underscore or a space, or without a separator: "q1 [deg]",
"q1_deg", "J1deg". Words such as "measured", "actual" or "tracker" in a heading are ignored. A joint
column with "commanded", "nominal" or "computed" in its heading is used only if the table has no
measured joint column.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterable, Sequence
from typing import NamedTuple

UNITS = {
    "m": ("m", 1.0),
    "mm": ("m", 1e-3),
    "cm": ("m", 1e-2),
    "um": ("m", 1e-6),
    "inch": ("m", 0.0254),
    "rad": ("rad", 1.0),
    "mrad": ("rad", 1e-3),
    "deg": ("rad", math.pi / 180),
    "°": ("rad", math.pi / 180),
}
_WORDS = {
    "grad": "deg",  # German word for degrees, used in German headers
    "degs": "deg",
    "degree": "deg",
    "degrees": "deg",
    "rads": "rad",
    "radian": "rad",
    "radians": "rad",
    "in": "inch",
    "inches": "inch",
    "µm": "um",
    "μm": "um",
    "meter": "m",
    "metre": "m",
    "meters": "m",
    "metres": "m",
    "millimeter": "mm",
    "millimetre": "mm",
    "millimeters": "mm",
    "millimetres": "mm",
}
"""Written-out and alternative names of units."""
AXES = ("x", "y", "z")
TARGET, STATION = "target", "station"
QUATERNION = ("qw", "qx", "qy", "qz")
ROTATION_VECTOR = ("rx", "ry", "rz")
ANGLES = ("roll", "pitch", "yaw")
MATRIX = tuple(f"r{i}{j}" for i in "123" for j in "123")
_BRACKETS = re.compile(r"[\[({<]\s*([^\])}>]*?)\s*[\])}>]")
_TOKEN = re.compile(r"°|\d+|[^\W\d_]+")


def _words(*texts: str) -> frozenset[str]:
    return frozenset(word for text in texts for word in text.split())


_JOINTS = _words(
    "q theta th θ ϑ φ joint joints jnt axis achse gelenk motor actuator drive j a ax rax",
    "jointangle angle angles",
)
_LEFT_OUT = _words(
    "measured meas measurement gemessen actual act ist tracker laser lt leica faro api vicon",
    "position positions pos coordinate coordinates coord tcp tool tip probe flange effector end ee",
    "pose value val robot state of the",
)
_PLANNED = _words(
    "commanded command cmd nominal nom desired des reference ref setpoint soll planned computed",
    "calculated calc model theoretical ideal fk",
)
_OTHER = _words(
    "error err deviation dev residual std sigma rms velocity speed vel torque current force"
)
_NUMBERED = _words("target targets point points marker markers smr nest ball p t m pt s")
_PLACES = _words("target marker point smr nest ball")
_STATIONS = _words("station standpoint")
_MATRICES = _words("r t m rot rotation matrix h")
_COMPONENTS = ("w", *AXES)
_MOTOMAN = tuple("slurbt")
_FANUC, _KUKA = ("w", "p", "r"), ("c", "b", "a")
_POSITIONS = frozenset((*AXES, "px", "py", "pz"))
_DOTTED = re.compile(r"[a-zA-Z]\.\d+$")
_COLUMNS = ("n", "o", "a")
"""First letters of rotation matrix headings such as nx, ox and ax. In Paul's notation, the columns
of a rotation matrix are the vectors n, o and a."""


class Column(NamedTuple):
    """A column of a table.

    Attributes:
        heading: Heading of the column, without the unit.
        number: Index of the column in the table, from 0.
        unit: Unit of the column: a key of `UNITS`, the text of an unknown unit, or "" for a column
            without a unit.
    """

    heading: str
    number: int
    unit: str


class NamedColumns(NamedTuple):
    """The recognized columns of a table."""

    columns: dict[str, Column]
    repeated: tuple[str, ...]
    said: tuple[str, ...]


class _Heading(NamedTuple):
    column: Column
    tokens: tuple[str, ...]
    planned: bool


def unit_of(word: str) -> str:
    """Return the key of `UNITS` for a word, or "" if the word is not a unit."""
    small = word.strip(" []()").lower()
    small = _WORDS.get(small, small)
    return small if small in UNITS else ""


def named(header: Sequence[str], own: Sequence[str]) -> NamedColumns:
    """Return the recognized columns of a table header.

    Args:
        header: Cells of the table header.
        own: Coordinate names of the robot.
    """
    headings = [
        heading
        for k, cell in enumerate(header)
        if cell.strip() and (heading := _heading(cell, k)) is not None
    ]
    found: dict[int, str] = {}
    said: list[str] = []
    measured = [heading for heading in headings if not heading.planned]
    if _has_coordinates(measured, own):
        headings = measured
    elif _has_coordinates(headings, own):
        said.append("coordinates are commanded, not measured")
    for rule in _RULES:
        rest = [heading for heading in headings if heading.column.number not in found]
        found |= rule(rest, own, said)
    columns: dict[str, Column] = {}
    repeated = []
    for heading in headings:
        name = found.get(heading.column.number, heading.column.heading.lower())
        if name not in columns:
            columns[name] = heading.column
        elif heading.column.number in found:
            repeated.append(name)
    return NamedColumns(columns, tuple(repeated), tuple(said))


def _heading(cell: str, number: int) -> _Heading | None:
    """Return the heading in a cell of the table header, or None if its column is ignored.

    Columns of errors, standard deviations, velocities, torques, currents and forces are ignored.
    """
    text, unit = cell.strip().strip("\"'"), ""
    for inside in _BRACKETS.findall(text):
        if not _is_named(inside):
            unit = unit_of(inside) or inside.strip()
    text = _BRACKETS.sub(lambda found: f" {found[1]}" if _is_named(found[1]) else " ", text).strip()
    words = _TOKEN.findall(text.lower())
    if not unit and len(words) > 1 and unit_of(words[-1]):
        unit = unit_of(words.pop())
        text = re.sub(r"[\s_.]*[^\W\d_°]+$|[\s_.]*°$", "", text)
    if set(words) & _OTHER:
        return None
    planned = bool(set(words) & _PLANNED) or _is_planned_joint(words)
    kept = [word for word in words if word not in _PLANNED]
    return _Heading(Column(text, number, unit), tuple(kept), planned)


def _is_named(inside: str) -> bool:
    """Return whether text in brackets is part of the column's name instead of a unit."""
    words = _TOKEN.findall(inside.lower())
    return inside.isdecimal() or (bool(words) and set(words) <= _LEFT_OUT | _PLANNED | _OTHER)


def _is_planned_joint(words: Sequence[str]) -> bool:
    """Return whether a heading names a commanded joint position, such as target_q_0."""
    return len(words) > 1 and words[0] == "target" and words[1] in _JOINTS


def _core(heading: _Heading) -> tuple[str, ...]:
    """Return the words of a heading that identify its column."""
    return tuple(word for word in heading.tokens if word not in _LEFT_OUT)


def _own(rest: Sequence[_Heading], own: Sequence[str], said: list[str]) -> dict[int, str]:
    """Find headings that are coordinate names of the robot, with or without a final "joint"."""
    del said
    known = {tuple(_TOKEN.findall(name.lower())): name for name in own}
    found = {}
    for heading in rest:
        tokens = heading.tokens
        trimmed = tokens[:-1] if tokens[-1:] == ("joint",) else tokens
        for candidate in (tokens, trimmed, _core(heading)):
            if candidate and candidate in known:
                found[heading.column.number] = known[candidate]
                break
    return found


def _joints(rest: Sequence[_Heading], own: Sequence[str], said: list[str]) -> dict[int, str]:
    found = {h.column.number: f"q{number}" for h in rest if (number := _joint(h)) is not None}
    if not found and len(own) == len(_MOTOMAN):
        letters = {_core(h)[0]: h.column.number for h in rest if len(_core(h)) == 1}
        if set(_MOTOMAN) <= letters.keys():
            found = {letters[letter]: f"q{k + 1}" for k, letter in enumerate(_MOTOMAN)}
            said.append("columns S, L, U, R, B and T are assumed to be joints 1 to 6")
    return found


def _joint(heading: _Heading) -> int | None:
    """Return the joint number in a heading, or None if the heading does not name a joint."""
    core = _core(heading)
    if heading.planned:
        core = tuple(word for word in core if word != TARGET)
    numbers = [word for word in core if word.isdecimal()]
    others = {word for word in core if not word.isdecimal()}
    return int(numbers[0]) if len(numbers) == 1 and others and others <= _JOINTS else None


def _has_coordinates(headings: Sequence[_Heading], own: Sequence[str]) -> bool:
    return any(_joint(h) is not None for h in headings) or bool(_own(headings, own, []))


def _numbered_quaternion(
    rest: Sequence[_Heading], own: Sequence[str], said: list[str]
) -> dict[int, str]:
    """Find the four columns of a quaternion with the headings q1 ... q4 or q0 ... q3.

    The four columns count as a quaternion only if the table also has joint columns with other
    names.
    """
    del own
    numbers = {
        int(h.tokens[-1]): h.column.number
        for h in rest
        if len(h.tokens) > 1 and h.tokens[-1].isdecimal() and set(h.tokens[:-1]) <= {"q", "quat"}
    }
    joints = sum(_joint(h) is not None for h in rest)
    first = min(numbers, default=0)
    if sorted(numbers) != list(range(first, first + 4)) or first > 1 or joints <= len(numbers):
        return {}
    said.append(f"columns q{first} to q{first + 3} are assumed to be a quaternion w, x, y, z")
    return {numbers[first + k]: QUATERNION[k] for k in range(4)}


def _turns(rest: Sequence[_Heading], own: Sequence[str], said: list[str]) -> dict[int, str]:
    """Find the columns of a quaternion, a rotation vector, roll-pitch-yaw angles or a matrix."""
    del own
    by_core = {_core(heading): heading.column.number for heading in rest if not heading.planned}
    found: dict[int, str] = {}
    for names, spellings in (
        (
            QUATERNION,
            [_spelled(("q", "quat", "quaternion", "orientation"), c) for c in _COMPONENTS],
        ),
        (ROTATION_VECTOR, [_spelled(("r", "rot", "rotvec", "rv"), c) for c in AXES]),
        (ANGLES, [{(name,)} for name in ANGLES]),
    ):
        found |= _all_of(by_core, names, spellings)
    if not found:
        for names, order, of in (
            (_FANUC, ANGLES, "w, p and r are rotations about the fixed x, y and z"),
            (_KUKA, ANGLES, "a, b and c are rotations about z, the new y and the new x"),
        ):
            if letters := _all_of(by_core, order, [{(letter,)} for letter in names]):
                said.append(f"columns {of}")
                return found | letters
    return found | _matrix(by_core)


def _spelled(before: Iterable[str], component: str) -> Collection[tuple[str, ...]]:
    return {
        spelling
        for word in before
        for spelling in ((word, component), (word + component,), (word, "vec", component))
    }


def _all_of(
    by_core: dict[tuple[str, ...], int],
    names: Sequence[str],
    spellings: Sequence[Collection[tuple[str, ...]]],
) -> dict[int, str]:
    """Return the standard name of each column, or an empty dict if a name has no column."""
    columns = [next((by_core[s] for s in own if s in by_core), None) for own in spellings]
    if any(column is None for column in columns):
        return {}
    return {column: name for column, name in zip(columns, names, strict=True) if column is not None}


def _matrix(by_core: dict[tuple[str, ...], int]) -> dict[int, str]:
    """Find the columns with the entries of a rotation matrix or a homogeneous matrix."""
    for first in (1, 0):
        spellings = [
            {(word, *digits) for word in _MATRICES for digits in ((f"{i}{j}",), (str(i), str(j)))}
            for i in range(first, first + 3)
            for j in range(first, first + 4)
        ]
        rotation = [own for k, own in enumerate(spellings) if (k + 1) % 4]
        if found := _all_of(by_core, MATRIX, rotation):
            return found | _all_of(by_core, AXES, spellings[3::4])
    letters = [{(f"{column}{axis}",)} for axis in AXES for column in _COLUMNS]
    return _all_of(by_core, MATRIX, letters)


def _points(rest: Sequence[_Heading], own: Sequence[str], said: list[str]) -> dict[int, str]:
    """Find the columns of positions, target names and station names."""
    del own, said
    found = {}
    for heading in rest:
        core = _core(heading) or heading.tokens
        if heading.planned:
            continue
        if position := _position(heading):
            found[heading.column.number] = "".join(position)
        elif len(core) == 1 and core[0] in _PLACES:
            found[heading.column.number] = TARGET
        elif len(core) == 1 and core[0] in _STATIONS:
            found[heading.column.number] = STATION
    return found


def _position(heading: _Heading) -> tuple[str, str] | None:
    """Return (axis, number) of a position heading such as "x 2", or None for other headings."""
    core = _core(heading)
    axes = [word[-1] for word in core if word in _POSITIONS]
    numbers = [word for word in core if word.isdecimal()]
    others = {word for word in core if word not in _POSITIONS and not word.isdecimal()}
    if heading.planned or len(axes) != 1 or len(numbers) > 1 or not others <= _NUMBERED:
        return None
    return axes[0], str(int(numbers[0])) if numbers else ""


def _targets_by_name(
    rest: Sequence[_Heading], own: Sequence[str], said: list[str]
) -> dict[int, str]:
    """Find the position columns of named targets, such as left_x, left_y and left_z.

    The targets are numbered in the order of appearance.
    """
    del own
    names: dict[tuple[str, ...], dict[str, int]] = {}
    for heading in rest:
        core = heading.tokens
        axes = [word for word in core if word in AXES]
        others = tuple(word for word in core if word not in AXES)
        if len(axes) == 1 and others and not heading.planned:
            names.setdefault(others, {})[axes[0]] = heading.column.number
    complete = [(words, axes) for words, axes in names.items() if set(AXES) <= axes.keys()]
    if complete:
        shown = ", ".join(f"{k} {' '.join(words)}" for k, (words, _) in enumerate(complete, 1))
        said.append(f"the named targets have these numbers: {shown}")
    return {
        number: f"{axis}{k}"
        for k, (_, axes) in enumerate(complete, 1)
        for axis, number in axes.items()
    }


def _again(rest: Sequence[_Heading], own: Sequence[str], said: list[str]) -> dict[int, str]:
    """Find the columns of several targets if the headings x, y and z are repeated.

    Pandas renames repeated headings x, y and z to x.1, y.1 and z.1.
    """
    del own
    plain: dict[str, list[int]] = {axis: [] for axis in AXES}
    dotted: dict[int, str] = {}
    for heading in rest:
        axis, number = _position(heading) or ("", "")
        if axis and not number:
            plain[axis].append(heading.column.number)
        elif axis and _DOTTED.search(heading.column.heading):
            dotted[heading.column.number] = axis + number
    times = {len(numbers) for numbers in plain.values()}
    if dotted and times == {1}:
        return dotted | {numbers[0]: f"{axis}0" for axis, numbers in plain.items()}
    if len(times) > 1 or max(times) in (0, 1):
        return {}
    said.append(f"columns x, y and z occur {max(times)} times, for {max(times)} targets")
    return {
        number: f"{axis}{k}"
        for axis, numbers in plain.items()
        for k, number in enumerate(numbers, 1)
    }


_Rule = Callable[[Sequence[_Heading], Sequence[str], list[str]], dict[int, str]]
_RULES: tuple[_Rule, ...] = (
    _own,
    _numbered_quaternion,
    _joints,
    _turns,
    _again,
    _points,
    _targets_by_name,
)
