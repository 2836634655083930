"""Reads fixed tendons with actuators as couplings of joints.

The length of a fixed tendon is a weighted sum of its joint positions. If n tendons with actuators
couple n joints, the tendon lengths determine the joints. The tendon lengths are then the
coordinates of the robot.
"""

from collections.abc import Iterator, Mapping, Sequence

import sympy as sp

from ....model.coupling import Coupling, Motor, MotorKind
from ..identifiers import identifier
from .mjcf_bodies import BodyJoint
from .mjcf_drives import Drives, Tendon


def tendon_couplings(
    drives: Drives, chain: Sequence[BodyJoint]
) -> tuple[tuple[Coupling, ...], tuple[Motor, ...]]:
    """Return the couplings of joints to tendons, and the tendons as motors.

    A tendon is omitted if its joints are not all determined or not all in the chain.

    Args:
        drives: The actuators and tendons of the model.
        chain: The joints of the chain.
    """
    kinds = {j.name: j.kind for j in chain if j.kind != "fixed" and j.coupling is None}
    couplings: list[Coupling] = []
    motors: list[Motor] = []
    for joints, tendons in _groups(drives, kinds):
        actuated = [name for name in joints if name in drives.joints]
        rows = [[dict(t.ratios).get(name, 0) for name in joints] for t in tendons]
        rows += [[int(name == other) for name in joints] for other in actuated]
        A = sp.Matrix(rows)
        if A.rows != A.cols or A.det() == 0:
            continue
        names = [identifier(name) for name in (*(t.name for t in tendons), *actuated)]
        own = zip(joints, A.inv().tolist(), strict=True)
        couplings += [
            Coupling(identifier(joint), tuple(zip(names, row, strict=True)))
            for joint, row in own
            if joint not in actuated
        ]
        motors += [_motor(tendon, kinds) for tendon in tendons]
    return tuple(couplings), tuple(motors)


def _groups(drives: Drives, kinds: Mapping[str, str]) -> Iterator[tuple[list[str], list[Tendon]]]:
    """Yield each set of coupled joints with its tendons."""
    taken = {identifier(name) for name in kinds}
    left = [
        tendon
        for tendon in drives.tendons
        if tendon.is_driven and tendon.ratios and identifier(tendon.name) not in taken
    ]
    while left:
        tendons = [left.pop(0)]
        joints = set(tendons[0].joints)
        while meeting := [tendon for tendon in left if joints & {*tendon.joints}]:
            left = [tendon for tendon in left if tendon not in meeting]
            tendons += meeting
            joints = joints.union(*(tendon.joints for tendon in meeting))
        if joints <= kinds.keys():
            yield [name for name in kinds if name in joints], tendons


def _motor(tendon: Tendon, kinds: Mapping[str, str]) -> Motor:
    slides = any(kinds[name] == "prismatic" for name in tendon.joints)
    kind: MotorKind = "prismatic" if slides else "revolute"
    return Motor(identifier(tendon.name), kind, tendon.limits)
