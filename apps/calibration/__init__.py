"""Calibration: identify the parameters of a robot from measurements of its tool.

    robot = chasles.load("ur5e", parametric=True)
    table = read_measurements("tracker.csv", robot)
    found = identify(robot, table.q, table.measurements)
    print(found)

Calibration needs SciPy: `pip install 'chasles[calibration]'`.
"""

from chasles.contract import requires

with requires("chasles[calibration]"):
    from .design import Design, optimal_design
    from .identify import identify
    from .measurements.circles import CirclePoints, MeasuredAxis
    from .measurements.contacts import Distances, PlaneContacts, SphereContacts
    from .measurements.measurement_table import MeasurementTable, read_measurements
    from .measurements.stations import StationPositions
    from .measurements.tool_measurements import Measurements, Poses, Positions
    from .model_selection import (
        CALIBRATION_MODELS,
        CalibrationModel,
        ModelSelection,
        cross_validate,
        select_model,
    )
    from .result import Calibration
    from .tool_errors import FirstOrderErrors, MonteCarloErrors, first_order_errors, monte_carlo

__all__ = [
    "CALIBRATION_MODELS",
    "Calibration",
    "CalibrationModel",
    "CirclePoints",
    "Design",
    "Distances",
    "FirstOrderErrors",
    "MeasuredAxis",
    "MeasurementTable",
    "Measurements",
    "ModelSelection",
    "MonteCarloErrors",
    "PlaneContacts",
    "Poses",
    "Positions",
    "SphereContacts",
    "StationPositions",
    "cross_validate",
    "first_order_errors",
    "identify",
    "monte_carlo",
    "optimal_design",
    "read_measurements",
    "select_model",
]
