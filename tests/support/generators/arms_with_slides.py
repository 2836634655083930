"""Random arms with prismatic joints: gantries, machine tools, cranes and planar arms."""

import random
from collections.abc import Sequence

from chasles.derive import SerialRobot, read_text

DIRECTIONS = ([1, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, 0])
ACROSS = ([1, 0, 0], [0, 0, 1], [1, 0, 1], [2, 0, -1])
"""Directions normal to the y axis."""
IN_PLANE = ((1, 0, 0), (0, 0, 1), (1, 0, 1), (-1, 0, 0), (2, 0, -1), (0, 0, -1))
"""Directions normal to the parallel joint axes, which are parallel to the y axis."""
HEAD = 'name = "r"\nconvention = "urdf"\nunits = { length = "mm", angle = "deg" }\n'


def robot(
    kinds: str, directions: Sequence[Sequence[float]], seed: int, *, meeting: bool = False
) -> SerialRobot:
    """Return a robot with revolute (R) and prismatic (P) joints."""
    draw = random.Random(seed)

    def point() -> list[float]:
        if seed % 2:
            return [draw.choice((0, 0, 100, -200, 300)) for _ in range(3)]
        return [round(draw.uniform(-300, 300), 1) for _ in range(3)]

    lines = [f"{HEAD}tool = {{ xyz = {point()}, rpy = [90, 0, 30] }}"]
    for k, (kind, direction) in enumerate(zip(kinds, directions, strict=True)):
        name = "revolute" if kind == "R" else "prismatic"
        lines += ["[[joints]]", f'name = "j{k}"', f'type = "{name}"']
        meets = meeting and kinds[:k].endswith("R") and kind == "R"
        lines += [f"xyz = {[0, 0, 0] if meets else point()}", f"axis = {direction}"]
    return read_text("\n".join(lines))


def decoupled(kinds: str, seed: int, *, meeting: bool = False) -> SerialRobot:
    """Return an arm of revolute (R) and prismatic (P) joints.

    Args:
        kinds: The joint types.
        seed: Random seed. Seed 1 generates joint axes along the base axes, and odd seeds generate
            lengths that are multiples of 100 mm.
        meeting: Whether adjacent revolute axes intersect.
    """
    draw = random.Random(f"{kinds}{seed}")
    turns, slides = draw.sample(DIRECTIONS[:3], 3), draw.sample(DIRECTIONS[:3], 3)
    if seed > 1:
        turns = [_direction(draw) for _ in range(3)]
        slides = slides if meeting else [_direction(draw) for _ in range(3)]
    directions = [(turns if kind == "R" else slides).pop() for kind in kinds]
    return robot(kinds, directions, seed, meeting=meeting)


def planar(kinds: str, seed: int) -> SerialRobot:
    """Return an arm whose revolute axes are parallel.

    In ``kinds``, R denotes a revolute joint, and T and L denote prismatic joints normal and
    parallel to the revolute axes.
    """
    draw = random.Random(seed)
    directions = [draw.choice(ACROSS) if kind == "T" else [0, 1, 0] for kind in kinds]
    return robot(kinds.replace("L", "P").replace("T", "P"), directions, seed)


def _direction(draw: random.Random) -> list[float]:
    return [round(draw.uniform(-1, 1), 2) for _ in range(3)]


def crane(
    order: str, *, hand: bool, round_numbers: bool, seed: int, wrist: bool = False
) -> SerialRobot:
    """Return a random arm with a slewing joint, and with its tool on or off the last axis.

    Args:
        order: Joint types (R or P) of the joints that move in a plane.
        hand: Whether the arm has an additional revolute joint with its axis in the plane in which
            the joints of ``order`` move.
        round_numbers: Whether all lengths are multiples of 100 mm.
        seed: Random seed of the arm.
        wrist: Whether the arm ends with two intersecting axes of random directions.
    """
    draw = random.Random(seed)

    def length(share: float) -> float:
        if round_numbers:
            return draw.choice((0, 0, 100, 300, 500, -200))
        return round(draw.uniform(-share, share), 1)

    def point(share: float) -> list[float]:
        return [length(share) for _ in range(3)]

    axes = [("slew", "revolute", (0, 0, 1))]
    for k, letter in enumerate(order):
        kind = "revolute" if letter == "R" else "prismatic"
        axes.append((f"plane_{k}", kind, (0, 1, 0) if letter == "R" else draw.choice(IN_PLANE)))
    if hand:
        axes.append(("hand", "revolute", draw.choice(IN_PLANE)))
    axes += [(name, "revolute", _direction(draw)) for name in ("bend", "roll") if wrist]
    lines = [HEAD]
    for name, kind, axis in axes:
        lines += ["[[joints]]", f'name = "{name}"', f'type = "{kind}"']
        xyz = [0, 0, 0] if name == "roll" else point(500)
        lines += [f"xyz = {xyz}", f"axis = {list(axis)}"]
    on_axis = draw.random() < 0.5
    tool = f"xyz = {point(300)}" if not on_axis else "xyz = [0, 0, 0]"
    return read_text("\n".join([*lines[:1], f"tool = {{ {tool} }}", *lines[1:]]))
