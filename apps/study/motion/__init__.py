"""Motions: curves, laws of time, and a robot on them with all rates and accelerations."""

from .conics import ConicArc, conic
from .curves import (
    Arc,
    CurvePoses,
    JointLine,
    Line,
    PoseCurve,
    Spline,
    TaskCurve,
    TaskLine,
    arc,
    blended,
    joint_line,
    line,
    parabola,
    task_curve,
    task_line,
    through,
)
from .laws import Law, law
from .motion import Excess, Motion, Sampled, excesses, joined
from .sequence import Sequence, Stage
from .time_optimal import time_optimal

__all__ = [
    "Arc",
    "ConicArc",
    "CurvePoses",
    "Excess",
    "JointLine",
    "Law",
    "Line",
    "Motion",
    "PoseCurve",
    "Sampled",
    "Sequence",
    "Spline",
    "Stage",
    "TaskCurve",
    "TaskLine",
    "arc",
    "blended",
    "conic",
    "excesses",
    "joined",
    "joint_line",
    "law",
    "line",
    "parabola",
    "task_curve",
    "task_line",
    "through",
    "time_optimal",
]
