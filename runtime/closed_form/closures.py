"""The methods of a robot with loops: whether poses close, and all branches."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import BoolArray, FloatArray
from ..call.capabilities import needs
from ..contract import Coordinate
from ..facts import RobotFacts
from ..iterative.newton import NewtonMethods
from ..tolerances import SAME_JOINTS
from .solutions import Solutions, solutions_of

_PLANAR = ["prismatic", "prismatic", "revolute"]


class ChainBranches(NamedTuple):
    """All configurations of the main chain at given actuated coordinates.

    Attributes:
        theta: (..., k, n_theta) main-chain joints [rad or m], NaN where a branch does not close.
        valid: (..., k) whether it closes.
        margin: (..., k) or (..., k, steps) sin^2 of the transmission angle: 0 at a dead point.
    """

    theta: FloatArray
    valid: BoolArray
    margin: FloatArray


class ActuatorBranches(NamedTuple):
    """All actuated coordinates at given joints of the main chain.

    Attributes:
        q: (..., k, n) actuated coordinates [rad or m], NaN where a branch does not close.
        valid: (..., k) whether it closes.
        margin: (..., k) or (..., k, steps) sin^2 of the transmission angle: 0 at a dead point.
    """

    q: FloatArray
    valid: BoolArray
    margin: FloatArray


def is_planar(robot: RobotFacts) -> bool:
    """Whether the main chain of a robot is a body that moves freely in a plane."""
    return [joint.kind for joint in robot.chain_joints] == _PLANAR


def has_leg_inverse(robot: RobotFacts) -> bool:
    """Whether the actuated coordinates follow from the main chain."""
    return not robot.functions.keys().isdisjoint(("actuators_all", "actuators"))


def is_planar_with_inverse(robot: RobotFacts) -> bool:
    """Whether the main chain is a body in a plane, from which the actuated coordinates follow."""
    return is_planar(robot) and has_leg_inverse(robot)


def _can_check_actuators(robot: RobotFacts) -> bool:
    closes_everywhere = "chain" in robot.functions and not robot.manifest.is_iterated
    return closes_everywhere or ("margin", "actuators", "") in robot._roles


def _can_check_chain(robot: RobotFacts) -> bool:
    return not robot.manifest.is_iterated or ("margin", "chain", "") in robot._roles


class LoopMethods(NewtonMethods):
    """The methods of a robot with loops."""

    @needs(when=_can_check_actuators)
    def loops_close(self, q: ArrayLike) -> BoolArray:
        """Return whether the loops close at actuated coordinates, dead points included.

        Limits play no part. Loops without a dead point, such as parallelograms, close everywhere.
        For loops without a closed form, the result is whether Newton's iteration reaches these
        coordinates from the reference configuration.

        Args:
            q: (..., n) [rad or m].

        Returns:
            (...,): False also where an input is not finite.
        """
        guard = self._roles.get(("margin", "actuators", ""))
        if guard is not None:
            return _closes(guard(q))
        is_real = np.isfinite(self.chain(q)).all(-1) & np.isfinite(q).all(-1)
        return np.asarray(is_real)

    @needs("actuators", when=_can_check_chain)
    def chain_closes(self, theta: ArrayLike) -> BoolArray:
        """Return whether `chain(actuators(theta))` is theta, dead points included.

        The result is False for joints that the loops do not allow together, although `actuators`
        returns a number for them: it reads no more joints than it needs. It is also False on other
        branches than that of the reference configuration, for example beyond a dead point.
        `actuator_branches` holds the actuated coordinates on all branches.

        Args:
            theta: (..., n_theta) main-chain joints [rad or m].

        Returns:
            (...,): False also where an input is not finite.
        """
        held = np.asarray(np.isfinite(theta).all(-1))
        guard = self._roles.get(("margin", "chain", ""))
        if guard is not None:
            held = np.asarray(held & _closes(guard(theta)))
        # Where the iteration finds the chain, it finds one of several modes.
        is_free = self.manifest.is_iterated and len(self.chain_joints) == self.n
        if ("map", "actuators", "chain") in self._roles and not is_free:
            rows = np.asarray(theta, dtype=np.float64)
            q = self._roles["map", "chain", "actuators"](np.atleast_2d(rows))
            again = self._roles["map", "actuators", "chain"](q)
            back = self._is_same(again, np.atleast_2d(rows))
            held = np.asarray(held & back.reshape(rows.shape[:-1]))
        return held

    def _is_same(self, theta: FloatArray, other: FloatArray) -> BoolArray:
        """Whether joints of the main chain (..., n_theta) are the same."""
        return _is_small(theta - other, self.chain_joints, self.unit_length)

    def _is_repeated(self, q: FloatArray, closes: BoolArray) -> BoolArray:
        """Whether a valid slot (..., k) has the actuated coordinates of one before it."""
        apart = q[..., :, None, :] - q[..., None, :, :]
        alike = _is_small(apart, self.coordinates, self.unit_length) & closes[..., None, :]
        return np.asarray(np.tril(alike, -1).any(-1))

    def _leads_to(self, q: FloatArray, theta: FloatArray) -> BoolArray:
        """Whether actuated coordinates (..., k, n) hold joints (..., n_theta) on any branch."""
        every, _ = self._roles["branches", "actuators", "chain"](q)
        return np.asarray(self._is_same(every, theta[..., None, None, :]).any(-1))

    @needs("chain_all")
    def chain_branches(self, q: ArrayLike) -> ChainBranches:
        """Return every configuration of the main chain that closes the loops, in fixed slots.

        Args:
            q: (..., n) actuated coordinates [rad or m].

        Returns:
            `theta (..., k, n_theta)`, `valid (..., k)`, `margin`; a slot keeps its branch from pose
            to pose, and `labels["chain_branches"]` names the branch in each slot.
        """
        theta, margin = self.functions["chain_all"](q)
        return ChainBranches(theta, _branch_closes(theta, margin), margin)

    @needs("actuators_all")
    def actuator_branches(self, theta: ArrayLike) -> ActuatorBranches:
        """Return every vector of actuated coordinates at these joints, in fixed slots.

        All branches of the loops count, not only the branch of the reference configuration.

        Args:
            theta: (..., n_theta) main-chain joints [rad or m].

        Returns:
            `q (..., k, n)`, `valid (..., k)`, `margin`; a slot keeps its branch from pose to pose,
            and `labels["actuator_branches"]` names the branch in each slot.
        """
        q, margin = self.functions["actuators_all"](theta)
        closes = _branch_closes(q, margin)
        if self.n < len(self.chain_joints) and ("branches", "actuators", "chain") in self._roles:
            # More joints than freedoms: the loops may not allow these joints together.
            closes = closes & self._leads_to(q, np.asarray(theta, dtype=np.float64))
            closes = closes & ~self._is_repeated(q, closes)
            q = np.where(closes[..., None], q, np.nan)
        return ActuatorBranches(q, closes, margin)

    @needs(when=is_planar_with_inverse)
    def ik_planar(self, x: ArrayLike) -> Solutions:
        """The inverse of a planar platform, leg by leg: all actuated coordinates at a pose.

        Args:
            x: (..., 3): x, y [m] and phi [rad] of the platform.

        Returns:
            Solutions, with two branches per leg, k is 8 for three legs. Legs that are cylinders
            have one branch, whose margin is 1. `margin` is the smallest of the legs, `residual` 0
            if the legs close, else infinite: a residual of the loops, not of `fk(q)`, which
            follows one of several assembly modes.
        """
        if "actuators_all" in self.functions:
            q, closes, margin = self.actuator_branches(x)
        else:
            q, margin = self._leg_branches(x)
            closes = np.isfinite(margin)
        margin = margin if margin.ndim == closes.ndim else margin.min(-1)
        labels = self.labels.get("actuator_branches", ())
        kind = solutions_of(self.coordinates, self.manifest.wraps, labels, self.unit_length)
        return kind(q, np.where(closes, 0.0, np.inf), margin, closes)

    def _leg_branches(self, theta: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """(..., k, n) actuated coordinates of all branches, and their margins."""
        if "actuators_all" in self.functions:
            q, margin = self.functions["actuators_all"](theta)
            return q, margin
        q = self.actuators(theta)[..., None, :]
        return q, np.where(np.isfinite(q).all(-1), 1.0, np.nan)


def _is_small(apart: FloatArray, variables: Sequence[Coordinate], unit_length: float) -> BoolArray:
    """Whether differences (..., n) of variables are those of the same ones, up to whole turns."""
    turns = np.array([variable.unit == "rad" for variable in variables])
    rest = np.where(turns, np.remainder(apart + np.pi, 2 * np.pi) - np.pi, apart)
    return np.asarray((np.abs(rest) < SAME_JOINTS * np.where(turns, 1.0, unit_length)).all(-1))


def _closes(margin: FloatArray) -> BoolArray:
    return np.asarray((np.isfinite(margin) & (margin >= 0)).all(-1))


def _branch_closes(values: FloatArray, margin: FloatArray) -> BoolArray:
    closes = np.asarray(np.isfinite(values).all(-1))
    return closes & _closes(margin.reshape(*closes.shape, -1))
