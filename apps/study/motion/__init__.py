"""Robot motions along curves, with exact joint rates and accelerations."""

from .conics import ConicArc, conic
from .curves import (
    Arc,
    JointLine,
    Line,
    PoseCurve,
    Spline,
    arc,
    blend,
    joint_line,
    line,
    parabola,
    spline,
)
from .global_redundancy import resolve_redundancy
from .limits import LimitViolation, limit_violations
from .motion import Motion
from .sequence import MotionSequence
from .task_curves import TaskCurve, TaskLine, task_curve, task_line
from .time_optimal import time_optimal
from .time_scaling import TimeScaling, time_scaling
from .trajectory import Trajectory, concatenate

__all__ = [
    "Arc",
    "ConicArc",
    "JointLine",
    "LimitViolation",
    "Line",
    "Motion",
    "MotionSequence",
    "PoseCurve",
    "Spline",
    "TaskCurve",
    "TaskLine",
    "TimeScaling",
    "Trajectory",
    "arc",
    "blend",
    "concatenate",
    "conic",
    "joint_line",
    "limit_violations",
    "line",
    "parabola",
    "resolve_redundancy",
    "spline",
    "task_curve",
    "task_line",
    "time_optimal",
    "time_scaling",
]
