"""Random chains with every joint type."""

import random
from dataclasses import dataclass

import numpy as np
import sympy as sp

from chasles.derive import Coupling, Joint, SerialRobot
from chasles.derive.description.conventions import urdf

KINDS = ("revolute", "revolute", "revolute", "prismatic", "helical", "fixed")
RIGHT_ANGLES = (0, 0, sp.pi / 2, -sp.pi / 2, sp.pi, -sp.pi)
AXES = ((1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, -1), (-1, 0, 0), (1, 1, 0), (1, 2, 3), (0, 3, -4))
PITCH = sp.Rational(1, 10)


@dataclass(frozen=True)
class Link:
    """Joint type, placement and axis of one joint."""

    kind: str
    xyz: tuple
    rpy: tuple
    axis: tuple
    coupling: Coupling | None = None


@dataclass(frozen=True)
class Chain:
    links: tuple[Link, ...]
    tool: Link

    def robot(self) -> SerialRobot:
        joints = []
        for k, link in enumerate(self.links):
            before, after = urdf(link.kind, xyz=link.xyz, rpy=link.rpy, axis=link.axis)
            pitch = PITCH if link.kind == "helical" else sp.Integer(0)
            joint = Joint(f"j{k}", link.kind, before, after, pitch=pitch)
            joints.append(joint)
        tool, _ = urdf("fixed", xyz=self.tool.xyz, rpy=self.tool.rpy, axis=self.tool.axis)
        couplings = tuple(link.coupling for link in self.links if link.coupling)
        return SerialRobot("chain", tuple(joints), tool=tool, couplings=couplings)

    def pinocchio(self):
        """Return (Pinocchio model, frame indices of the links and the tool)."""
        import pinocchio as pin

        model, parent, frames = pin.Model(), 0, []
        placement = pin.SE3.Identity()
        for k, link in enumerate(self.links):
            placement = placement * _se3(link)
            if link.kind != "fixed":
                axis = np.array(link.axis, float)
                axis /= np.linalg.norm(axis)
                parent = model.addJoint(parent, _joint(link.kind, axis), placement, f"j{k}")
                placement = pin.SE3.Identity()
            frame = pin.Frame(f"l{k}", parent, 0, placement, pin.FrameType.OP_FRAME)
            frames.append(model.addFrame(frame))
        placement = placement * _se3(self.tool)
        frame = pin.Frame("tool", parent, 0, placement, pin.FrameType.OP_FRAME)
        return model, [*frames, model.addFrame(frame)]


def random_chain(generator: random.Random, joints: int) -> Chain:
    """Return a random chain with at least one degree of freedom."""
    links: list[Link] = []
    for k in range(joints):
        kind = generator.choice(KINDS) if k else "revolute"
        leaders = [j for j, link in enumerate(links) if link.kind != "fixed" and not link.coupling]
        follows = kind in ("revolute", "prismatic") and leaders and generator.random() < 0.15
        coupling = None
        if follows:
            multiplier = sp.Rational(generator.randint(-20, 20) or 3, 10)
            offset = sp.Rational(generator.randint(-9, 9), 10)
            leader = f"j{generator.choice(leaders)}"
            coupling = Coupling(f"j{k}", ((leader, multiplier),), offset)
        axis = generator.choice(AXES)
        links.append(Link(kind, _xyz(generator), _rpy(generator), _exact(axis), coupling))
    tool = Link("fixed", _xyz(generator), _rpy(generator), _exact((0, 0, 1)))
    return Chain(tuple(links), tool)


def _exact(vector):
    return tuple(sp.sympify(value) for value in vector)


def _xyz(generator):
    zero = generator.random() < 0.4
    return _exact(0 if zero else sp.Rational(generator.randint(-900, 900), 1000) for _ in range(3))


def _rpy(generator):
    right = generator.random() < 0.6
    return _exact(
        generator.choice(RIGHT_ANGLES)
        if right
        else sp.Rational(generator.randint(-3000, 3000), 1000)
        for _ in range(3)
    )


def _se3(link):
    import pinocchio as pin

    rotation = pin.rpy.rpyToMatrix(*(float(angle) for angle in link.rpy))
    return pin.SE3(rotation, np.array([float(value) for value in link.xyz]))


def _joint(kind, axis):
    import pinocchio as pin

    if kind == "revolute":
        return pin.JointModelRevoluteUnaligned(axis)
    if kind == "prismatic":
        return pin.JointModelPrismaticUnaligned(axis)
    return pin.JointModelHelicalUnaligned(axis, float(PITCH))
