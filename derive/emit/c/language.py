"""The language C: functions of a single pose, branches side by side, batches on vector lanes."""

from ...derivation import Derivation
from ...program.programs import Programs
from . import batch, branch_lanes, polished, scalar, written
from .header import header, support


def files(derivation: Derivation, programs: Programs) -> dict[str, str]:
    """The sources and headers of a robot, with the support files of all robots, by file name."""
    robot, functions = derivation.robot, derivation.functions
    return {
        f"{robot.name}.c": scalar.source(robot, functions, programs, derivation.written),
        f"{robot.name}.h": header(robot, (*functions, *derivation.written), programs),
        scalar.SUPPORT: support(scalar.SUPPORT),
        **written.written_files(robot, derivation.written),
        **polished.polished_files(derivation, programs),
        **branch_lanes.files(robot, functions, programs),
        **batch.files(robot, functions, programs, derivation.written),
    }
