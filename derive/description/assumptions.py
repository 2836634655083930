"""Lists the assumed values, which are limits and dimensions that the source does not state."""

from collections.abc import Iterable, Iterator, Sequence

from ..model.mechanism import Closure, Drive, Strut
from ..model.robot import Joint, Parameter


def assumption(
    parameters: Sequence[Parameter],
    joints: Sequence[Joint],
    loop_joints: Sequence[Closure | Strut] = (),
    drives: Sequence[Drive] = (),
) -> tuple[str, ...]:
    """Return a note that lists all assumed limits and dimensions, or () if there are none.

    Args:
        parameters: The lengths, angles and ratios that have names.
        joints: All joints.
        loop_joints: Closures, rods and cylinders of the description.
        drives: Motors with gears.
    """
    struts = [loop_joint for loop_joint in loop_joints if isinstance(loop_joint, Strut)]
    named: dict[str, list[str]] = {}
    members: tuple[Joint | Strut, ...] = (*joints, *struts)
    for member in members:
        for field in member.assumed:
            named.setdefault(field, []).append(member.name)
    parts = [f"{field} of {', '.join(names)}" for field, names in named.items()]
    parts += _list("parameters", (p.name for p in parameters if p.assumed))
    parts += _list("ratios of", (drive.name for drive in drives if drive.assumed))
    parts += _list("points of", _assumed_sides(loop_joints))
    return (f"assumed, not stated by the source: {'; '.join(parts)}",) if parts else ()


def _assumed_sides(loop_joints: Iterable[Closure | Strut]) -> Iterator[str]:
    for loop_joint in loop_joints:
        for side, frame in (("a", loop_joint.a), ("b", loop_joint.b)):
            if frame.assumed:
                yield f"{loop_joint.name} on {frame.body} ({side})"


def _list(word: str, names: Iterable[str]) -> list[str]:
    found = ", ".join(names)
    return [f"{word} {found}"] if found else []
