"""Skeletons of robot descriptions, computed without deriving or compiling robot functions."""

from types import SimpleNamespace

import numpy as np

from chasles.contract import ActuatedVariable, Load, LoopFacts
from chasles.derive.derivation import Derivation
from chasles.derive.emit.manifest import skeleton_facts
from chasles.derive.loops.model.coupling_equations import joint_couplings
from chasles.derive.model.mechanism import Mechanism
from chasles.derive.terms.terms import Terms
from chasles.drawing import skeleton
from tests.support.loops.solved import solved
from tests.support.robot_stand_in import RobotStandIn


def described_skeleton(robot):
    """Return the skeleton of a description, with all loops in the reference configuration."""
    hybrid = solved(robot) if isinstance(robot, Mechanism) else None
    robot = hybrid.mechanism if hybrid else robot
    terms = hybrid.terms if hybrid else Terms({p.symbol: p.value for p in robot.parameters})
    found = Derivation(robot, terms, (), (), hybrid).skeleton
    names = list(hybrid.at_reference) if hybrid else []
    facts = skeleton_facts(found)
    z = np.array(list(hybrid.at_reference.values())) if hybrid else None
    moved = (
        [(names.index(c.moves), float(terms.value(c.ratio))) for c in robot.coordinates]
        if hybrid
        else []
    )
    stand_in = RobotStandIn(
        name=robot.name,
        n=len(robot.coordinates),
        coordinates=[SimpleNamespace(name=c.name) for c in robot.coordinates],
        base_frame=robot.base_frame,
        tip_frame=robot.tool_frame,
        configuration_variables=[SimpleNamespace(name=name) for name in names],
        configuration=lambda q: np.broadcast_to(z, (*np.shape(q)[:-1], len(z))),
        reference=SimpleNamespace(q=[z[k] / ratio for k, ratio in moved]) if hybrid else None,
        lower=np.full(len(robot.coordinates), -np.inf),
        upper=np.full(len(robot.coordinates), np.inf),
        manifest=SimpleNamespace(
            skeleton=facts,
            load=Load(),
            loops=LoopFacts(
                actuated_in_z=tuple(ActuatedVariable(k, ratio) for k, ratio in moved),
                joint_couplings=joint_couplings(robot, names) if hybrid else (),
            ),
        ),
    )
    return skeleton(stand_in)
