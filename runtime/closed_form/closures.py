"""What a robot with loops offers beside its functions: which poses close, and all branches."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..call._call import Function
from ..call.capabilities import needs
from ..contract.manifest import Coordinate
from ..iterative.newton import NewtonMethods

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
_TOGETHER = 1e-6
"""Joints (radian, metre) that differ by less are the same: near a dead point a margin of 1e-10, the
rounding of the lengths makes half of the digits uncertain."""
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


def _moves_a_plane(robot: LoopMethods) -> bool:
    return [joint.kind for joint in robot.chain_joints] == _PLANAR


def _says_what_closes(robot: LoopMethods) -> bool:
    return robot.solution == "newton" or "margin" in robot.functions


def _can_hold(robot: LoopMethods) -> bool:
    return "actuator_margin" in robot.functions or robot.solution != "newton"


class LoopMethods(NewtonMethods):
    """The part of a robot that its loops bring along."""

    chain_joints: tuple[Coordinate, ...]
    margin: Function[FloatArray]
    actuator_margin: Function[FloatArray]
    chain_all: Function[tuple[FloatArray, FloatArray]]
    actuators_all: Function[tuple[FloatArray, FloatArray]]

    @needs(when=_says_what_closes)
    def valid(self, q: ArrayLike) -> BoolArray:
        """Whether the loops close at actuated coordinates; dead points do.

        Limits are not looked at. Where loops are solved by Newton's iteration: whether it reaches
        those coordinates from the reference configuration.

        Args:
            q: (..., n) [rad or m].

        Returns:
            (...,): False also where an input is not finite.
        """
        return self.follow(q).valid if self.solution == "newton" else _closes(self.margin(q))

    @needs("actuators", when=_can_hold)
    def actuators_valid(self, theta: ArrayLike) -> BoolArray:
        """Whether the actuators can hold the main chain at given joints; dead points count.

        Joints that the loops do not let come together are none, though `actuators` has a number for
        them: it reads no more joints than it needs. Nor are joints that another branch has.

        Args:
            theta: (..., n_theta) main-chain joints [rad or m].

        Returns:
            (...,): False also where an input is not finite.
        """
        held = np.asarray(np.isfinite(theta).all(-1))
        if "actuator_margin" in self.functions:
            held = held & _closes(self.actuator_margin(theta))
        if "chain" in self.functions and self.solution != "newton":
            held = held & self._comes_back(np.asarray(theta, dtype=np.float64))
        return held

    def _comes_back(self, theta: FloatArray) -> BoolArray:
        """Whether the actuators of some joints give these joints again, on whatever branch."""
        rows = np.atleast_2d(theta)
        q = self.functions["actuators"](rows)
        if "chain_all" in self.functions:
            again = self.chain_all(q)[0]
        else:
            again = self.functions["chain"](q)[..., None, :]
        apart = again - rows[..., None, :]
        turns = [joint.unit == "rad" for joint in self.chain_joints]
        apart[..., turns] = np.remainder(apart[..., turns] + np.pi, 2 * np.pi) - np.pi
        back = (np.abs(apart) < _TOGETHER).all(-1).any(-1)
        return np.asarray(back).reshape(theta.shape[:-1])

    @needs("chain_all")
    def chain_branches(self, q: ArrayLike) -> ChainBranches:
        """Every configuration of the main chain that closes the loops, in fixed slots.

        Args:
            q: (..., n) actuated coordinates [rad or m].

        Returns:
            `theta (..., k, n_theta)`, `valid (..., k)`, `margin`; no slot is ever left out, so that
            a slot keeps its branch from pose to pose.
        """
        theta, margin = self.chain_all(q)
        return ChainBranches(theta, _branch_closes(theta, margin), margin)

    @needs("actuators_all")
    def actuator_branches(self, theta: ArrayLike) -> ActuatorBranches:
        """Every vector of actuated coordinates that holds the main chain there, in fixed slots.

        Args:
            theta: (..., n_theta) main-chain joints [rad or m].

        Returns:
            `q (..., k, n)`, `valid (..., k)`, `margin`; a slot keeps its branch from pose to pose.
        """
        q, margin = self.actuators_all(theta)
        return ActuatorBranches(q, _branch_closes(q, margin), margin)

    @needs("actuators_all", when=_moves_a_plane)
    def ik_planar(self, pose: ArrayLike) -> ActuatorBranches:
        """Every way to hold a planar platform at a pose: the inverse, leg by leg.

        Args:
            pose: (..., 3): x, y [m] and phi [rad] of the platform.

        Returns:
            `q (..., k, n)`, `valid (..., k)`, `margin`; with two branches a leg, k is 8 for three
            legs.
        """
        return self.actuator_branches(pose)


def _closes(margin: FloatArray) -> BoolArray:
    return np.asarray((np.isfinite(margin) & (margin >= 0)).all(-1))


def _branch_closes(values: FloatArray, margin: FloatArray) -> BoolArray:
    closes = np.asarray(np.isfinite(values).all(-1))
    if margin.ndim > closes.ndim:
        return closes & _closes(margin)
    return closes & (margin >= 0)
