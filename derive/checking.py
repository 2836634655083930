"""Reports all errors of a robot description, and whether the loops of the robot can be closed."""

from collections.abc import Sequence
from pathlib import Path

from .derivation import derive
from .description.checking import Finding, checked, finding_of
from .description.shipped_files import located
from .loops.checks.closable import doubts_of, limits_of
from .model.errors import DescriptionError
from .model.mechanism import Mechanism


def check(
    source: str | Path,
    *,
    base: str | None = None,
    tip: str | None = None,
    group: str | None = None,
    arguments: Sequence[str] = (),
) -> tuple[Finding, ...]:
    """Report the errors, warnings and notes of a robot description.

    In a robot file (.toml), the check corrects each error in memory and continues, so that it
    reports all independent errors. In files of all other formats, the check reports only the first
    error. If a valid robot has loops, the loops are solved at the reference configuration.

    Args:
        source: The file or the robot name, as for ``read``.
        base: The link whose frame is the base frame. The default is the same as for ``read``.
        tip: The link whose frame is the tool frame. The default is the same as for ``read``.
        group: A group of the SRDF file in the same folder, instead of base and tip.
        arguments: Argument values of a xacro file, each as ``name:=value``.

    Returns:
        The errors, sorted by line. If an error cannot be corrected, the last finding states that
        the check ended early. If the robot has no errors, the result contains only warnings and
        notes. For a robot with loops, the notes include the joint limits at which loops do not
        close.

    Raises:
        UnknownRobotError: No robot has this name.
    """
    findings, robot = checked(source, base, tip, group, arguments)
    if not isinstance(robot, Mechanism):
        return findings
    file = str(located(source)[0])
    try:
        hybrid = derive(robot).hybrid
    except DescriptionError as error:
        return (finding_of(error, file),)
    remarks = () if hybrid is None else (*limits_of(hybrid), *doubts_of(hybrid))
    return (*findings, *(Finding("note", file, remark) for remark in remarks))
