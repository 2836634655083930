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

    In a robot file, all independent errors are found, because the check continues with a corrected
    value after each error. The check ends early if no corrected value exists, for example for an
    unknown convention. If the description has no errors, the loops of the robot are solved at the
    reference.

    Args:
        source: A file or the name of a robot; see ``read``.
        base: The link whose frame is the base frame.
        tip: The link whose frame is the tool frame.
        group: A group of an SRDF file next to the description, instead of base and tip.
        arguments: Argument values of a xacro file, each as ``name:=value``.

    Returns:
        The errors, sorted by line; for a valid robot, the warnings and notes. For a robot with
        loops, notes list the joint limits at which the loops cannot be closed. The last note states
        whether the check ended early.

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
