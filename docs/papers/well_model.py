"""Compares equations on the well manipulator: Lie groups and two kinematic models of joints."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from report import TWICE, Finding, Printed, Row, agrees, at, consistent, erratum
from scipy.spatial.transform import Rotation
from well_process import initial, robot

from chasles import se3
from chasles.derive import model_report, read
from chasles.derive.quality.quality_report import ConventionQuality, ModelReport, plain

FloatArray = NDArray[np.float64]

ROBOT_FILES = Path(__file__).parents[2] / "derive" / "robots"
A, B = np.array([0.3, -0.7, 1.1]), np.array([-0.4, 0.9, 0.2])
"""Two vectors."""
AXIS, V, THETA = np.array([2.0, -1.0, 2.0]) / 3, np.array([0.3, -0.2, 0.5]), 0.7
"""Unit vector omega and linear part v of a screw, and an angle [rad]."""
EXTENDED = np.array([0.4, 0, 0, 0.11, 0, 0.07, 0])
"""Joint displacements from the start configuration [rad or m], with extended telescopes, to test
equation (36)."""
TILT = 1e-6
"""The tilt [rad] of an axis that is nominally parallel to the preceding axis."""
STEP = 1e-5
"""Half the step of a central difference quotient [rad]."""
SMALL = 1e-9
"""Matrix entries below this value count as 0."""


# Equations (1) to (5) of the paper, on Lie groups


def hat(a: FloatArray) -> FloatArray:
    """Return the cross-product matrix (3, 3) of a vector by equation (3)."""
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def exp(theta: float) -> FloatArray:
    """Return the pose (4, 4) after a screw motion by an angle [rad], computed by chasles."""
    return np.asarray(se3.exp(theta * np.r_[V, AXIS]))


def by_equation_5(theta: float) -> FloatArray:
    """Return the pose (4, 4) after a screw motion by equation (5), with rotation from chasles."""
    T = exp(theta)
    R = T[:3, :3]
    T[:3, 3] = (np.eye(3) - R) @ np.cross(AXIS, V) + np.outer(AXIS, AXIS) @ V * theta
    return T


def lie_group_rows(printed: dict[str, Printed]) -> list[Row]:
    """Compare the Lie group equations of section 2 at generic values."""
    first, other = exp(THETA), exp(-2 * THETA) @ exp(0.3)
    values = {f"a{k}": value for k, value in enumerate(A, 1)}
    slope = (exp(THETA + STEP) - exp(THETA - STEP))[:3, :3] / (2 * STEP)
    is_rate = np.allclose(slope, hat(AXIS) @ first[:3, :3], atol=SMALL)
    whole = se3.exp(np.r_[V, AXIS] * THETA)
    return [
        agrees(
            printed["rotation"],
            Finding(is_rotation(first[:3, :3]), "this for the exponential of a screw"),
        ),
        agrees(
            printed["pose"],
            Finding(
                is_rotation((first @ other)[:3, :3]), "that the product of two poses is a pose"
            ),
        ),
        agrees(
            printed["hat"],
            np.cross(A, B),
            "we compared the products of this matrix and a vector b",
            evaluated=lambda item: at(**values)(item) @ B,
        ),
        agrees(
            printed["exponential"],
            whole,
            "we evaluated equation (5) at theta = 0.7 rad, with omega of length 1",
            evaluated=lambda _: by_equation_5(THETA),
        ),
        erratum(
            printed["series"],
            third_coefficient(),
            1 / 6,
            "the correct term is theta^3/3!. The factorial sign may be missing in our copy alone",
            evaluated=at(theta=1.0),
        ),
        agrees(printed["rate"], Finding(is_rate, "this by a difference quotient")),
    ]


def is_rotation(R: FloatArray) -> bool:
    """Test whether a matrix is orthogonal with determinant 1."""
    pairs = ((R @ R.T, np.eye(3)), (R.T @ R, np.eye(3)), (np.linalg.det(R), 1))
    return all(np.allclose(own, value, atol=SMALL) for own, value in pairs)


def third_coefficient() -> float:
    """Return the coefficient of theta^3 omega^3 in exp(omega theta), from a polynomial fit."""
    theta = np.cos(np.linspace(0, np.pi, 24))
    W = hat(AXIS)
    along = [np.vdot(W, exp(value)[:3, :3]) / np.vdot(W, W) for value in theta]
    # omega^3 is -omega.
    return float(-np.polynomial.polynomial.polyfit(theta, along, 15)[3])


# Completeness, continuity and minimality


@cache
def quality() -> ModelReport:
    """Return a report that compares the kinematic conventions for each joint of the manipulator."""
    return model_report(read(ROBOT_FILES / "well_manipulator.toml"))


def convention(name: str, joint: int = 0) -> ConventionQuality:
    """Return the quality of a convention for consecutive joint axes; the first pair has index 0."""
    (found,) = [c for c in quality().joints[joint].conventions if c.convention == name]
    return found


def model_rows(printed: dict[str, Printed]) -> list[Row]:
    """Compare section 3 of the paper with the results of chasles.

    Model (6) of the paper is the convention `mdh5` of chasles, and model (8) is `hayati5`.
    """
    report = quality()
    numbers = {"r": report.revolute, "t": report.prismatic}
    six, whole = convention("mdh5").determinant, convention("mdh5").completed
    zeros = dict.fromkeys(whole.free_symbols, 0)
    pairs = [(joint.angle, convention("mdh5", k)) for k, joint in enumerate(report.joints)]
    parallel = [own.is_continuous for angle, own in pairs if abs(np.sin(angle)) < SMALL]
    others = [own.is_continuous for angle, own in pairs if abs(np.sin(angle)) >= SMALL]
    words = convention("hayati5", 1).verdict.replace(", ", " and ")
    return [
        consistent(printed["det_6"], plain(six), TWICE),
        consistent(printed["det_whole"], plain(whole), TWICE),
        consistent(printed["det_8"], plain(convention("hayati5").determinant), TWICE),
        erratum(
            printed["zeros"],
            Finding(bool(six.free_symbols), f"that det(D^T D) is {plain(six)} everywhere"),
            Finding(
                whole.subs(zeros) == 0,
                f"with the rotation of the preceding joint, det(D^T D) is {plain(whole)}",
            ),
            "the zeros of 8 sin(alpha)^2 are the discontinuous points of equation (7). With the "
            "parameters of equation (6) alone, the determinant has no zero",
        ),
        agrees(
            printed["only_parallel"],
            Finding(
                not any(parallel) and all(others),
                f"discontinuities for {len(parallel)} of {len(parallel)} pairs of parallel axes "
                f"and 0 of {len(others)} other pairs",
            ),
        ),
        agrees(
            printed["figure_2"],
            jump_of_theta(),
            f"the paper says: “{printed['figure_2'].text}”",
        ),
        agrees(
            printed["continuous_8"],
            Finding(
                convention("hayati5", 1).is_continuous,
                f"that the model is {words}",
            ),
            "we evaluated the model between the parallel axes 2 and 3",
        ),
        agrees(
            printed["complete"],
            report.suitable_rank,
            "our value is the rank of the identification Jacobian at random configurations. The "
            "robot has r = 5 revolute and t = 2 prismatic joints",
            evaluated=at(**numbers),
        ),
        erratum(
            printed["parameters"],
            report.suitable_rank,
            at(**numbers)(printed["complete"]),
            "the fifth parameter shifts the frame along its axis, which no tool pose reveals",
            evaluated=at(**numbers),
        ),
    ]


def jump_of_theta() -> float:
    """Return the jump of theta in model (6) [rad] when one of two parallel axes tilts by `TILT`.

    The x axis of the preceding frame is along the common normal. Therefore, the rotation between
    the two joint axes is Rz Rx(alpha) Rz(theta).
    """
    tilted = Rotation.from_euler("Y", TILT) * Rotation.from_euler("Z", THETA)
    return float(abs(tilted.as_euler("ZXZ")[2] - THETA))


# Errors in equations


def equation_rows(printed: dict[str, Printed]) -> list[Row]:
    """Compare equations (25), (33) and (36) with the link poses."""
    well = robot()
    poses = well.link_poses(well.actuators(initial() + EXTENDED))
    T = dict(zip(well.link_names, poses, strict=True))
    value = {name: parameter.value for name, parameter in well.parameters.items()}
    own, l_MN = T["arm_7"][:3, 3], EXTENDED[5]
    four, five = T["arm_5"][:3, 0], T["arm_6"][:3, 0]
    others = T["arm_5"][:3, 3] + l_MN * five + T["arm_6"][:3, :2] @ (value["N_x"], value["N_y"])
    pairs = (("arm_4", "arm_5"), ("arm_6", "arm_7"))
    shifts = [se3.inverse(T[a]) @ T[b] for a, b in pairs]
    y, tilt = [S[1, 3] for S in shifts], [np.abs(S[:2, 2]).max() for S in shifts]
    return [
        erratum(
            printed["figure_3"],
            Finding(
                max(map(abs, y)) < SMALL,
                f"shifts of {1e3 * y[0]:.1f} mm and {1e3 * y[1]:.1f} mm along y",
            ),
            Finding(max(tilt) < SMALL, "coordinate systems 5 and 7 follow figure 1 and model (6)"),
            "between parallel axes, model (8) of figure 3 shifts a frame along x and z only. With "
            "the values of equation (64), transformations (25) and (33) also shift it along y",
        ),
        erratum(
            printed["equation_36"],
            own,
            others + value["l_LM"] * four,
            "the correct length is l_LM instead of l_MN, as in equation (32). The values are for "
            "the configuration of equation (63) with theta1 = 0.4 rad, l_HI = 110 mm and l_MN = 70 "
            "mm",
            evaluated=lambda _: others + l_MN * four,
        ),
    ]
