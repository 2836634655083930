"""Reads the actuators, tendons and springs of an MJCF model.

In a robot with loops, the actuators of joints define the coordinates q. Tendons, slider-cranks and
springs are not modeled, so notes list them. A tendon equality between joints raises an error.
"""

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp

from ....model.errors import DescriptionError
from ..identifiers import identifier

OF_JOINTS = ("mjTRN_JOINT", "mjTRN_JOINTINPARENT")


@dataclass(frozen=True)
class Tendon:
    """A tendon.

    Attributes:
        name: Name of the tendon. The name of an unnamed tendon contains its index.
        joints: The joints over which a fixed tendon runs.
        bodies: The bodies with the sites of a spatial tendon.
        ratios: A pair (joint, coefficient) for each joint of a fixed tendon. The coefficient is the
            change of the tendon length per unit of the joint position.
        limits: Minimum and maximum length of the tendon. None if unbounded.
        is_spring: Whether the tendon has a stiffness.
        is_driven: Whether an actuator drives the tendon.
        is_fixed: Whether an equality keeps the tendon length constant.
    """

    name: str
    joints: tuple[str, ...]
    bodies: tuple[str, ...]
    is_spring: bool
    is_driven: bool
    is_fixed: bool
    ratios: tuple[tuple[str, sp.Expr], ...] = ()
    limits: tuple[sp.Expr | None, sp.Expr | None] = (None, None)

    def moves(self, joints: Collection[str], bodies: Collection[str]) -> bool:
        """Whether the tendon moves one of the named joints or bodies."""
        return bool({*self.joints} & {*joints} or {*self.bodies} & {*bodies})

    @property
    def note(self) -> str:
        """State that the tendon is not modeled."""
        over = f"joints {', '.join(self.joints)}" if self.joints else "sites"
        facts = [
            text
            for text, holds in (
                ("driven by an actuator", self.is_driven),
                ("a spring", self.is_spring),
                ("fixed by an equality", self.is_fixed),
            )
            if holds
        ]
        about = f" ({', '.join(facts)})" if facts else ""
        return f"tendon {self.name} over {over}{about} is not modeled: q holds joint positions"


@dataclass(frozen=True)
class Drives:
    """The actuators, tendons and springs of a model.

    Attributes:
        joints: The joints with an actuator, in the order of the actuators.
        tendons: All tendons.
        cranks: Slider-crank actuators.
        springs: The joints with a stiffness.
    """

    joints: tuple[str, ...]
    tendons: tuple[Tendon, ...]
    cranks: tuple[str, ...]
    springs: tuple[str, ...]

    def notes(
        self, joints: Collection[str], bodies: Collection[str], coordinates: Collection[str] = ()
    ) -> Iterator[str]:
        """Yield a note on each actuator, tendon or spring that is not modeled.

        Args:
            joints: Names of the robot joints.
            bodies: Names of the robot links.
            coordinates: Names of the tendons whose lengths are coordinates.
        """
        for tendon in self.tendons:
            if identifier(tendon.name) not in coordinates and tendon.moves(joints, bodies):
                yield tendon.note
        if coordinates:
            yield f"q holds the lengths of the driven tendons {', '.join(coordinates)}"
        if self.cranks:
            yield f"slider-crank actuators are not modeled: {', '.join(self.cranks)}"
        springs = [name for name in self.springs if name in joints]
        if springs:
            yield f"joint springs are not modeled (stiffness of {', '.join(springs)})"

    def check_tendons(self, joints: Iterable[str]) -> None:
        """Raise an error if a tendon equality couples joints of the robot.

        Raises:
            DescriptionError: A tendon equality couples joints of the robot.
        """
        known = {*joints}
        for tendon in self.tendons:
            if tendon.is_fixed and known & {*tendon.joints}:
                raise DescriptionError(
                    f"an equality fixes the length of tendon {tendon.name!r} over joints "
                    f"{', '.join(tendon.joints)}; expected an equality of two joints, so that one "
                    "joint follows the other"
                )


def drives_of(spec: Any, mujoco: Any) -> Drives:
    """Return the actuated joints, tendons, slider-cranks and joint springs of a model."""
    kinds = [getattr(mujoco.mjtTrn, name) for name in OF_JOINTS]
    driven = {str(a.target) for a in spec.actuators if a.trntype == mujoco.mjtTrn.mjTRN_TENDON}
    equalities = [e for e in spec.equalities if e.type == mujoco.mjtEq.mjEQ_TENDON and e.active]
    constrained = {str(name) for e in equalities for name in (e.name1, e.name2)}
    return Drives(
        joints=tuple(str(a.target) for a in spec.actuators if a.trntype in kinds),
        tendons=tuple(
            _tendon(tendon, str(tendon.name or f"tendon{k + 1}"), driven, constrained, mujoco)
            for k, tendon in enumerate(spec.tendons)
        ),
        cranks=tuple(
            str(a.name or a.target)
            for a in spec.actuators
            if a.trntype == mujoco.mjtTrn.mjTRN_SLIDERCRANK
        ),
        springs=tuple(str(j.name) for j in spec.joints if np.any(np.asarray(j.stiffness))),
    )


def _tendon(
    tendon: Any, name: str, driven: Collection[str], constrained: Collection[str], mujoco: Any
) -> Tendon:
    wraps = list(tendon.path)
    parts = [w for w in wraps if w.type == mujoco.mjtWrap.mjWRAP_JOINT]
    joints = [w.target for w in parts]
    sites = [w.target for w in wraps if w.type == mujoco.mjtWrap.mjWRAP_SITE]
    return Tendon(
        name,
        tuple(str(joint.name) for joint in joints),
        tuple(dict.fromkeys(str(site.parent.name) for site in sites)),
        is_spring=bool(np.any(np.asarray(tendon.stiffness))),
        is_driven=name in driven,
        is_fixed=name in constrained,
        ratios=_ratios((str(w.target.name), float(w.coef)) for w in parts),
        limits=_limits(tendon),
    )


def _ratios(parts: Iterable[tuple[str, float]]) -> tuple[tuple[str, sp.Expr], ...]:
    found: dict[str, sp.Expr] = {}
    for name, coefficient in parts:
        found[name] = found.get(name, sp.S.Zero) + sp.Rational(repr(coefficient))
    return tuple(found.items())


def _limits(tendon: Any) -> tuple[sp.Expr | None, sp.Expr | None]:
    lower, upper = (float(value) for value in tendon.range)
    if not lower < upper:
        return None, None
    return sp.Rational(repr(lower)), sp.Rational(repr(upper))
