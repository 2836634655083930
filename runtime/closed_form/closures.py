"""Methods that test the loop closure and return all branches, for robots with loops."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import BoolArray, FloatArray, real_array
from ..call.capabilities import needs
from ..contract import Coordinate
from ..facts import RobotFacts
from ..iterative.newton import NewtonMethods
from ..tolerances import SAME_JOINTS
from .solutions import Solutions, solutions_of

_PLANAR = ["prismatic", "prismatic", "revolute"]


class ChainBranches(NamedTuple):
    """All configurations of the main chain for one vector of actuated coordinates.

    Attributes:
        theta: (..., k, n_theta) main-chain joints [rad or m]. NaN if the loops cannot be closed.
        valid: (..., k) whether the loops are closed on this branch.
        margin: (..., k) or (..., k, steps) sin^2 of the transmission angle: 0 at a dead point.
    """

    theta: FloatArray
    valid: BoolArray
    margin: FloatArray


class ActuatorBranches(NamedTuple):
    """All vectors of actuated coordinates for one configuration of the main chain.

    Attributes:
        q: (..., k, n) actuated coordinates [rad or m]. NaN if the loops cannot be closed.
        valid: (..., k) whether the loops are closed on this branch.
        margin: (..., k) or (..., k, steps) sin^2 of the transmission angle: 0 at a dead point.
    """

    q: FloatArray
    valid: BoolArray
    margin: FloatArray


def is_planar(robot: RobotFacts) -> bool:
    """Test whether the main-chain joints are prismatic, prismatic and revolute, in this order."""
    return [joint.kind for joint in robot.chain_joints] == _PLANAR


def has_leg_inverse(robot: RobotFacts) -> bool:
    """Test whether the actuated coordinates can be computed from the main-chain joints."""
    return not robot.functions.keys().isdisjoint(("actuators_all", "actuators"))


def is_planar_with_inverse(robot: RobotFacts) -> bool:
    """Test whether a robot is a planar platform whose legs have inverse kinematics."""
    return is_planar(robot) and has_leg_inverse(robot)


def _can_check_actuators(robot: RobotFacts) -> bool:
    closes_everywhere = "chain" in robot.functions and not robot.manifest.is_iterated
    return closes_everywhere or ("margin", "actuators", "") in robot._roles


def _can_check_chain(robot: RobotFacts) -> bool:
    if not robot.manifest.is_iterated or ("margin", "chain", "") in robot._roles:
        return True
    has_chain = ("map", "actuators", "chain") in robot._roles
    return len(robot.chain_joints) > robot.n if has_chain else "actuators_all" in robot.functions


class LoopMethods(NewtonMethods):
    """Methods of robots with loops."""

    @needs(when=_can_check_actuators)
    def loops_close(self, q: ArrayLike) -> BoolArray:
        """Test (...,) whether loops can be closed at q (..., n) [rad or m], dead points included.

        Limits are ignored. Loops without a dead point, such as parallelograms, can be closed
        everywhere. For loops without a closed form, Newton's method must reach q from the reference
        configuration. The result is False for an input that is not finite.
        """
        if (guard := self._roles.get(("margin", "actuators", ""))) is not None:
            return _closes(guard(q))
        return np.asarray(np.isfinite(self.chain(q)).all(-1) & np.isfinite(q).all(-1))

    @needs("actuators", when=_can_check_chain)
    def chain_closes(self, theta: ArrayLike) -> BoolArray:
        """Return (...,) whether `chain(actuators(theta))` is theta, dead points included.

        `actuators` reads only some of the joints theta (..., n_theta) [rad or m]. The result is
        False if the loops exclude theta, or if theta is on another branch than the reference
        configuration. The result is also False if theta is not finite.
        """
        rows = real_array(f"{self.name}.chain_closes", "theta", theta)
        batch, is_closed = np.atleast_2d(rows), np.isfinite(rows).all(-1)
        if (guard := self._roles.get(("margin", "chain", ""))) is not None:
            is_closed = is_closed & _closes(guard(rows))
        # An iteration finds only one of several assembly modes.
        is_free = self.manifest.is_iterated and len(self.chain_joints) == self.n
        if ("map", "actuators", "chain") in self._roles and not is_free:
            q = self._roles["map", "chain", "actuators"](batch)
            back = self._is_same(self._roles["map", "actuators", "chain"](q), batch)
            is_closed = is_closed & back.reshape(rows.shape[:-1])
        elif "fk" not in self.functions and "actuators_all" in self.functions:
            is_closed = is_closed & self.actuator_branches(rows).valid[..., 0]
        return np.asarray(is_closed)

    def _is_same(self, theta: FloatArray, other: FloatArray) -> BoolArray:
        return _is_small(theta - other, self.chain_joints, self.unit_length)

    def _is_repeated(self, q: FloatArray, closes: BoolArray) -> BoolArray:
        apart = q[..., :, None, :] - q[..., None, :, :]
        alike = _is_small(apart, self.coordinates, self.unit_length) & closes[..., None, :]
        return np.asarray(np.tril(alike, -1).any(-1))

    def _leads_to(self, q: FloatArray, theta: FloatArray) -> BoolArray:
        every, _ = self._roles["branches", "actuators", "chain"](q)
        return np.asarray(self._is_same(every, theta[..., None, None, :]).any(-1))

    @needs("chain_all")
    def chain_branches(self, q: ArrayLike) -> ChainBranches:
        """Return all main-chain configurations at q (..., n) [rad or m], one branch per slot.

        The result is `theta (..., k, n_theta)`, `valid (..., k)` and `margin`;
        `labels["chain_branches"]` lists the branch in each solution slot.
        """
        theta, margin = self.functions["chain_all"](q)
        return ChainBranches(theta, _branch_closes(theta, margin), margin)

    @needs("actuators_all")
    def actuator_branches(self, theta: ArrayLike) -> ActuatorBranches:
        """Return all actuated coordinates at theta (..., n_theta) [rad or m], one branch per slot.

        The result is `q (..., k, n)`, `valid (..., k)` and `margin`, on all loop branches;
        `labels["actuator_branches"]` lists the branch in each solution slot.
        """
        q, margin = self.functions["actuators_all"](theta)
        closes = _branch_closes(q, margin)
        if self.n < len(self.chain_joints) and ("branches", "actuators", "chain") in self._roles:
            # The array `theta` contains dependent joints, whose given values may violate the loop
            # closure.
            closes = closes & self._leads_to(q, np.asarray(theta, dtype=np.float64))
            closes = closes & ~self._is_repeated(q, closes)
            q = np.where(closes[..., None], q, np.nan)
        return ActuatorBranches(q, closes, margin)

    @needs(when=is_planar_with_inverse)
    def ik_planar(self, x: ArrayLike) -> Solutions:
        """Return all actuated coordinates of a planar platform at x, y [m], phi [rad] (..., 3).

        A revolute leg has two branches, so that k is 8 for three legs. A linear leg has one branch
        with margin 1. `margin` is the smallest leg margin. `residual` is 0 if `fk(q)` is the pose,
        otherwise infinite. `other_mode` is True for solution slots whose assembly mode at the pose
        differs from the assembly mode of `fk(q)`.
        """
        if "actuators_all" in self.functions:
            q, closes, margin = self.actuator_branches(x)
        else:
            q, margin = self._leg_branches(x)
            closes = np.isfinite(margin)
        margin = margin if margin.ndim == closes.ndim else margin.min(-1)
        if ("map", "actuators", "chain") in self._roles:
            reached = self._roles["map", "actuators", "chain"](q)
            closes = closes & self._is_same(reached, np.asarray(x, dtype=np.float64)[..., None, :])
        labels = self.labels.get("actuator_branches", ())
        kind = solutions_of(self.coordinates, self.manifest.wraps, labels, self.unit_length)
        return kind(q, np.where(closes, 0.0, np.inf), margin, closes)

    def _leg_branches(self, theta: ArrayLike) -> tuple[FloatArray, FloatArray]:
        if "actuators_all" in self.functions:
            q, margin = self.functions["actuators_all"](theta)
            return q, margin
        q = self.actuators(theta)[..., None, :]
        return q, np.where(np.isfinite(q).all(-1), 1.0, np.nan)


def _is_small(apart: FloatArray, variables: Sequence[Coordinate], unit_length: float) -> BoolArray:
    turns = np.array([variable.unit == "rad" for variable in variables])
    rest = np.where(turns, np.remainder(apart + np.pi, 2 * np.pi) - np.pi, apart)
    return np.asarray((np.abs(rest) < SAME_JOINTS * np.where(turns, 1.0, unit_length)).all(-1))


def _closes(margin: FloatArray) -> BoolArray:
    return np.asarray((np.isfinite(margin) & (margin >= 0)).all(-1))


def _branch_closes(values: FloatArray, margin: FloatArray) -> BoolArray:
    closes = np.asarray(np.isfinite(values).all(-1))
    return closes & _closes(margin.reshape(*closes.shape, -1))
