"""Actuators, tendons and springs of an MJCF model, as far as a description has to name them.

Actuators of joints say what q of a robot with loops is. Tendons, slider-cranks and springs are not
modelled: notes name them, and an equality that couples joints by tendons is refused.
"""

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ....model.errors import RobotError

OF_JOINTS = ("mjTRN_JOINT", "mjTRN_JOINTINPARENT")


@dataclass(frozen=True)
class Tendon:
    """A tendon.

    Attributes:
        name: Its name, or one made of its number.
        joints: The joints of a fixed tendon.
        bodies: The bodies with the sites of a spatial tendon.
        is_spring: Whether it has a stiffness.
        is_driven: Whether an actuator pulls it.
        is_held: Whether an equality holds its length.
    """

    name: str
    joints: tuple[str, ...]
    bodies: tuple[str, ...]
    is_spring: bool
    is_driven: bool
    is_held: bool

    def moves(self, joints: Collection[str], bodies: Collection[str]) -> bool:
        """Return whether it runs over one of some joints or bodies."""
        return bool({*self.joints} & {*joints} or {*self.bodies} & {*bodies})

    @property
    def note(self) -> str:
        """A sentence that names it as not modelled."""
        over = f"joints {', '.join(self.joints)}" if self.joints else "sites"
        facts = [
            text
            for text, holds in (
                ("driven by an actuator", self.is_driven),
                ("a spring", self.is_spring),
                ("held by an equality", self.is_held),
            )
            if holds
        ]
        about = f" ({', '.join(facts)})" if facts else ""
        return f"tendon {self.name} over {over}{about} is not modelled: q holds joint positions"


@dataclass(frozen=True)
class Drives:
    """Everything of a model that moves or pulls its joints.

    Attributes:
        joints: The joints that actuators move, in the order of the actuators.
        tendons: All tendons.
        cranks: Actuators that move sites by a slider and a crank.
        springs: The joints with a stiffness.
    """

    joints: tuple[str, ...]
    tendons: tuple[Tendon, ...]
    cranks: tuple[str, ...]
    springs: tuple[str, ...]

    def notes(self, joints: Collection[str], bodies: Collection[str]) -> Iterator[str]:
        """Yield a note on each part that moves a robot and is not modelled.

        Args:
            joints: Names of the robot's joints.
            bodies: Names of its links.
        """
        yield from (tendon.note for tendon in self.tendons if tendon.moves(joints, bodies))
        if self.cranks:
            yield f"actuators with slider and crank are not modelled: {', '.join(self.cranks)}"
        springs = [name for name in self.springs if name in joints]
        if springs:
            yield f"springs of joints are not modelled (stiffness of {', '.join(springs)})"

    def check_tendons(self, joints: Iterable[str]) -> None:
        """Refuse an equality of tendons over joints of a robot: it couples them.

        Raises:
            RobotError: There is one.
        """
        known = {*joints}
        for tendon in self.tendons:
            if tendon.is_held and known & {*tendon.joints}:
                raise RobotError(
                    f"an equality holds tendon {tendon.name!r} over joints "
                    f"{', '.join(tendon.joints)}; expected an equality of two joints, by which one "
                    "follows the other"
                )


def drives_of(spec: Any, mujoco: Any) -> Drives:
    """Return what moves the joints of a model, before MuJoCo compiles it."""
    kinds = [getattr(mujoco.mjtTrn, name) for name in OF_JOINTS]
    driven = {str(a.target) for a in spec.actuators if a.trntype == mujoco.mjtTrn.mjTRN_TENDON}
    equalities = [e for e in spec.equalities if e.type == mujoco.mjtEq.mjEQ_TENDON and e.active]
    held = {str(name) for e in equalities for name in (e.name1, e.name2)}
    return Drives(
        joints=tuple(str(a.target) for a in spec.actuators if a.trntype in kinds),
        tendons=tuple(
            _tendon(tendon, str(tendon.name or f"tendon{k + 1}"), driven, held, mujoco)
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
    tendon: Any, name: str, driven: Collection[str], held: Collection[str], mujoco: Any
) -> Tendon:
    wraps = list(tendon.path)
    joints = [w.target for w in wraps if w.type == mujoco.mjtWrap.mjWRAP_JOINT]
    sites = [w.target for w in wraps if w.type == mujoco.mjtWrap.mjWRAP_SITE]
    return Tendon(
        name,
        tuple(str(joint.name) for joint in joints),
        tuple(dict.fromkeys(str(site.parent.name) for site in sites)),
        is_spring=bool(np.any(np.asarray(tendon.stiffness))),
        is_driven=name in driven,
        is_held=name in held,
    )
