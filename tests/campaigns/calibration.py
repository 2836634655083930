"""Identification of random robots: error reduction, confidence intervals and warnings.

Each arm has axis errors up to 1 mm and 1 mrad. The arm is measured at 60 configurations with noise
of 0.02 mm and 0.05 mrad. The measurements are poses, positions of three targets, or positions with
5 mm outliers in 5 % of the rows.

With all frames unknown, the identification must reduce the mean error at validation configurations
by a factor of 20, or nearly to the reference error. An efficient estimator exceeds the reference
error with a probability of at most ``LEVEL``.

The confidence intervals of the axis parameters must contain the true values in 95 of 100 arms. To
test the confidence intervals, the identification receives the true base frame, because an error of
the base frame would shift all axes equally. The confidence intervals of one arm are correlated, so
the number of intervals that contain the true value has no simple distribution. A trial therefore
computes the vector z of the k axis parameter errors, each divided by its standard deviation. The
correlation matrix R of the normalized axis errors z is computed from independent derivatives. For k
normalized errors z with correlation matrix R, ``z^T R^-1 z / k`` has an F distribution with k and M
(residual) degrees of freedom. Fisher's method combines the probabilities of all arms, separately
for too narrow and too wide intervals.

A correct identification fails a random trial with a probability of at most ``(DRAWS + 2) LEVEL``,
which is below 1e-6. For measurements with outliers, the errors have the F distribution only
approximately.

The odd-numbered trials test the warnings of the identification. The robots of these trials are
serial arms, a delta robot and other robots with loops. The measuring devices of the trials cover
all kinds of measurements. The simulated measurements are few or many, exact or noisy, with and
without tolerances. Correct measurements must fit within the stated noise and cause no warning about
the robot. Measurements of a different robot, exchanged columns and a wrong angle unit must cause a
warning or an error. Too few measured values may cause an error.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import stats

import chasles
from chasles import se3, so3
from chasles.calibration import Calibration, Poses, Positions, identify
from chasles.calibration.measurements.frames import register_points, register_poses
from tests.support.calibration_verdicts import verdict
from tests.support.generators.simulated_measurements import (
    in_degrees,
    simulated,
    with_exchanged_columns,
)
from tests.support.oracles.noise_bound import derivative, least_error

from .campaign import Campaign, Outcome
from .tracker import ARMS

ROBOTS = (*ARMS, "bricklaying_gantry")
JUDGED = (*ROBOTS, "delta", "four_bar", "five_bar", "excavator", "slider_crank", "well_manipulator")
"""Names of the robots of odd-numbered trials, which test the warnings."""
DRAWS = 40
"""Number of random arms per trial."""
SIGMA = 2e-5, 5e-5
"""Standard deviations of the position and rotation noise [m, rad]."""
OFF = 1e-3
GROSS, SHARE = 5e-3, 0.05
CONFIGURATIONS, HELD = 60, 2_000
FALL = 20
"""Minimum factor by which the identification must reduce the error."""
NEAR = 1.1
"""Maximum ratio of the error after identification to the error that an efficient estimator exceeds
with a probability of at most `LEVEL`."""
LEVEL = 1e-8
"""Probability that a correct identification fails one statistical test.

A trial tests the error of each arm, and tests whether the confidence intervals are too narrow or
too wide."""
REACH = 2.5
"""Maximum magnitude of a random coordinate [rad or m]."""


@dataclass(frozen=True)
class Drawn:
    """A random arm: geometry, frames, and measured configurations."""

    p: np.ndarray
    T_W_base: np.ndarray
    T_tool_probe: np.ndarray
    targets: np.ndarray
    q: np.ndarray
    validation: np.ndarray


@dataclass(frozen=True)
class Judged:
    """Error measures of the identification of one arm.

    Attributes:
        fall: Ratio of the nominal robot's mean error to the mean error after identification.
        over: Ratio of the mean error after identification to the Cramer-Rao bound.
        is_reached: Whether the identified error is at most `NEAR` times the error limit of an
            efficient estimator.
        inside: Whether each confidence interval contains the true axis parameter.
        probability: Probability that random errors of the axis parameters are smaller than the
            observed errors.
    """

    fall: float
    over: float
    is_reached: bool
    inside: np.ndarray
    probability: float


def trial(number: int) -> Outcome:
    """Test errors and confidence intervals in even trials, and warnings in odd trials."""
    return accusations(number // 2) if number % 2 else errors(number // 2)


def accusations(number: int) -> Outcome:
    """Identify one robot from correct and from wrong measurements, and test the warnings."""
    robot = chasles.load(JUDGED[number % len(JUDGED)], parametric=True)
    failures, counts = [], {"right": 0, "wrong": 0, "too few": 0}
    for seed in np.random.default_rng(number).integers(1 << 32, size=DRAWS):
        right = simulated(robot, int(seed))
        found = verdict(robot, right)
        counts["too few" if found.is_too_few else "right"] += 1
        if not (found.is_too_few or found.is_clean):
            failures.append(f"seed {seed}, {right}: {found.text}")
        if robot.kind != "serial":
            continue
        exchanged = with_exchanged_columns(right, int(seed))
        wrong = {"exchanged": exchanged, "degrees": in_degrees(robot, right)}
        if right.parameter_std or "geometry" not in right.vary:
            wrong["another"] = simulated(robot, int(seed), another=True)
        for word, draw in wrong.items():
            counts["wrong"] += 1
            if not verdict(robot, draw).is_answered:
                failures.append(f"seed {seed}, {word}, {draw}: no warning")
    return Outcome(counts, tuple(f"{robot.name}, {f}" for f in failures))


def errors(number: int) -> Outcome:
    """Identify several random arms of one robot."""
    kind = list(KINDS)[number % len(KINDS)]
    robot = chasles.load(ROBOTS[number // len(KINDS) % len(ROBOTS)], parametric=True)
    rng = np.random.default_rng(number)
    found = [judged(robot, KINDS[kind], rng) for _ in range(DRAWS)]
    failures = [
        f"the error of arm {k} falls {arm.fall:.3g}-fold, to {arm.over:.3g} times the bound"
        for k, arm in enumerate(found)
        if not (arm.fall >= FALL or arm.is_reached)
    ]
    inside = np.concatenate([arm.inside for arm in found])
    below = np.array([arm.probability for arm in found])
    for word, tail in (("narrow", 1 - below), ("wide", below)):
        combined = stats.combine_pvalues(np.maximum(tail, 1e-300)).pvalue
        if not combined > LEVEL:
            text = (
                f"intervals are too {word}, p = {combined:.1e}; {inside.mean():.1%} hold the truth"
            )
            failures.append(text)
    counts = {"arms": DRAWS, "intervals": inside.size, "that hold the truth": int(inside.sum())}
    largest = {"error relative to the bound": max(arm.over for arm in found)}
    return Outcome(counts, tuple(f"{robot.name}, {kind}: {f}" for f in failures), largest)


def judged(robot, measure: Callable, random: np.random.Generator) -> Judged:
    """Generate, measure and identify a random arm."""
    drawn = _drawn(robot, random)
    measurements = measure(robot, drawn, random)
    found = identify(robot, drawn.q, measurements)
    before, after = _errors(robot, drawn, measurements, found)
    bound, limit = least_error(robot, drawn, found, random, LEVEL)
    # Measurements without noise.
    known = identify(robot, drawn.q, measurements, T_W_base=drawn.T_W_base)
    exact = SOUND.get(measure, measure)(robot, drawn, random, 0.0)._placed_as(known.measurements)
    inside, probability = _intervals(robot, drawn, known, exact)
    return Judged(before / after, after / bound, after <= NEAR * limit, inside, probability)


def _intervals(
    robot, drawn: Drawn, known: Calibration, exact: Poses | Positions
) -> tuple[np.ndarray, float]:
    """Return whether each confidence interval contains the true axis parameter, and a probability.

    The probability states how likely random errors are to be smaller than the observed errors.
    Different parameter values can describe the same geometry, so one Newton step on noise-free
    measurements computes the identified parameters of the true geometry.
    """
    apart = exact._errors(known.poses(drawn.q), known.unknowns)
    J = derivative(robot, known, exact, drawn.q, known.T_W_base, known.p, known.unknowns)
    true = known.values - np.linalg.lstsq(J, apart)[0]
    axes = [k for k, name in enumerate(known.names) if "_shift_" in name or "_tilt_" in name]
    C = np.linalg.inv(J.T @ J)[np.ix_(axes, axes)]
    std = np.sqrt(np.diag(C))
    low, high = known.confidence_intervals[axes].T
    half = (high - low) / 2
    z = (true[axes] - (low + high) / 2) / half * stats.t.ppf(0.975, known.residual_dof)
    value = z @ np.linalg.solve(C / np.outer(std, std), z) / len(axes)
    inside = (low <= true[axes]) & (true[axes] <= high)
    return inside, float(stats.f.cdf(value, len(axes), known.residual_dof))


def _drawn(robot, random: np.random.Generator) -> Drawn:
    p = np.array([g.value for g in robot.geometry])
    off = np.array([g.part == "axis" for g in robot.geometry])
    p[off] += random.uniform(-OFF, OFF, off.sum())
    low, high = _span(robot)
    return Drawn(
        p,
        se3.exp(random.normal(size=6) * 2),
        se3.exp(random.normal(size=6) * [0.1, 0.1, 0.1, 2, 2, 2]),
        random.uniform(-0.15, 0.15, (3, 3)),
        random.uniform(low, high, (CONFIGURATIONS, robot.n)),
        random.uniform(low, high, (HELD, robot.n)),
    )


def _span(robot) -> tuple[np.ndarray, np.ndarray]:
    """Return the coordinate limits, restricted to `REACH`."""
    if robot.kind != "serial":
        return np.maximum(robot.lower, -REACH), np.where(
            np.isfinite(robot.upper), robot.upper, REACH
        )
    return np.maximum(robot.lower, -REACH), np.minimum(robot.upper, REACH)


def _placed(T: np.ndarray, targets: np.ndarray) -> np.ndarray:
    return T[:, None, :3, 3] + np.einsum("nij,mj->nmi", T[:, :3, :3], targets)


def _poses(robot, drawn: Drawn, random: np.random.Generator, noise: float = 1.0) -> Poses:
    T = drawn.T_W_base @ robot.fk_p(drawn.q, drawn.p) @ drawn.T_tool_probe
    turned = so3.exp(noise * SIGMA[1] * random.normal(size=(len(T), 3)))
    T[:, :3, 3] += noise * SIGMA[0] * random.normal(size=(len(T), 3))
    T[:, :3, :3] = turned @ T[:, :3, :3]
    return Poses(T, SIGMA)


def _positions(robot, drawn: Drawn, random: np.random.Generator, noise: float = 1.0) -> Positions:
    points = _placed(drawn.T_W_base @ robot.fk_p(drawn.q, drawn.p), drawn.targets)
    return Positions(points + noise * SIGMA[0] * random.normal(size=points.shape), SIGMA[0])


def _gross(robot, drawn: Drawn, random: np.random.Generator) -> Positions:
    found = _positions(robot, drawn, random)
    wrong = random.random(found.points.shape[:2]) < SHARE
    found.points[wrong] += GROSS * random.normal(size=(wrong.sum(), 3))
    return found


KINDS = {"poses": _poses, "three targets": _positions, "three targets, 5 % gross": _gross}
SOUND = {_gross: _positions}
"""Maps each kind of measurements with gross errors to the same kind without gross errors."""


def _errors(robot, drawn: Drawn, measurements, found) -> tuple[float, float]:
    """Return the mean errors [m] of the nominal and the calibrated robot."""
    true = drawn.T_W_base @ robot.fk_p(drawn.validation, drawn.p)
    measured = robot.fk(drawn.q)
    if isinstance(measurements, Poses):
        probes = true @ drawn.T_tool_probe
        calibrated = found.poses(drawn.validation) @ found.measurements.T_tool_probe
        T_W_base, T_tool_probe = register_poses(measured, measurements.T)
        nominal = T_W_base @ robot.fk(drawn.validation) @ T_tool_probe
        return _mean(nominal - probes), _mean(calibrated - probes)
    points = _placed(true, drawn.targets)
    calibrated = _placed(found.poses(drawn.validation), found.unknowns.reshape(-1, 3))
    nominal = register_points(measured, measurements.points)
    of_nominal = _placed(nominal.T_W_base @ robot.fk(drawn.validation), nominal.points)
    before, after = (
        float(np.linalg.norm(x - points, axis=-1).mean()) for x in (of_nominal, calibrated)
    )
    return before, after


def _mean(apart: np.ndarray) -> float:
    return float(np.linalg.norm(apart[:, :3, 3], axis=-1).mean())


CAMPAIGN = Campaign(
    "calibration",
    "Identification reduces the error as far as noise allows; its intervals and warnings hold.",
    trial,
)
