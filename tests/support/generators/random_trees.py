"""Random trees of links as URDF and as robot files."""

import random

import numpy as np

from tests.support.generators.random_urdf import AXES, RIGHT, vector

TYPES = ("revolute", "revolute", "continuous", "prismatic", "fixed")
LINKS = (6, 14)
LIMITS = '<limit lower="-2" upper="1.5" effort="1" velocity="1"/>'


class RandomTree:
    """A random tree of links.

    Attributes:
        joints: Name, type, parent, child, xyz, rpy and axis of each joint, with parent joints
            first.
        links: Names of the links, with the root first.
    """

    def __init__(self, dice: random.Random) -> None:
        self.links = ["l0"]
        self.joints = []
        for k in range(1, dice.randint(*LINKS)):
            rpy = [dice.choice(RIGHT) for _ in range(3)]
            rpy = " ".join(rpy) if dice.random() < 0.5 else vector(dice)
            kind = dice.choice(TYPES) if k > 1 else "revolute"
            parent = dice.choice(self.links)
            numbers = vector(dice), rpy, dice.choice(AXES)
            self.joints.append((f"j{k}", kind, parent, f"l{k}", *numbers))
            self.links.append(f"l{k}")

    @property
    def urdf(self) -> str:
        """The tree as URDF."""
        parts = [f'<link name="{link}"/>' for link in self.links]
        for name, kind, parent, child, xyz, rpy, axis in self.joints:
            limits = LIMITS if kind in ("revolute", "prismatic") else ""
            parts.append(
                f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"'
                f'/><origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>{limits}</joint>'
            )
        return "\n".join(['<robot name="tree">', *parts, "</robot>"])

    @property
    def toml(self) -> str:
        """The tree as a robot file, without limits."""
        moving = [joint[0] for joint in self.joints if joint[1] != "fixed"]
        lines = ['name = "tree"', 'convention = "urdf"', 'units = { length = "m", angle = "rad" }']
        lines += [f"actuated = {moving}", 'base = { name = "l0" }']
        for name, kind, parent, child, xyz, rpy, axis in self.joints:
            written = "revolute" if kind == "continuous" else kind
            numbers = {"xyz": xyz, "rpy": rpy, **({} if kind == "fixed" else {"axis": axis})}
            lines += [
                "[[joints]]",
                f'name = "{name}"',
                f'type = "{written}"',
                f'parent = "{parent}"',
            ]
            lines += [f'link = "{child}"']
            lines += [f"{key} = {value.split()}" for key, value in numbers.items()]
        return "\n".join(lines)

    def ends(self, dice: random.Random) -> tuple[str, str]:
        """Return two links with a moving joint between them."""
        while True:
            base, tip = dice.sample(self.links, 2)
            up, down = self._to_root(base), self._to_root(tip)
            if any(kind != "fixed" for _, kind in up ^ down):
                return base, tip

    def _to_root(self, link: str) -> set[tuple[str, str]]:
        carrying = {child: (name, kind, parent) for name, kind, parent, child, *_ in self.joints}
        found = set()
        while link in carrying:
            name, kind, link = carrying[link]
            found.add((name, kind))
        return found


class PinocchioTree:
    """Poses of all links, computed with Pinocchio's reader."""

    def __init__(self, urdf: str) -> None:
        import pinocchio as pin

        self.pin, self.model = pin, pin.buildModelFromXML(urdf)
        self.data = self.model.createData()

    def random(self, rng: np.random.Generator) -> dict[str, float]:
        """Return random values of all joints, keyed by name."""
        return {name: rng.uniform(-2, 2) for name in self.model.names[1:]}

    def poses(self, values: dict[str, float]) -> dict[str, np.ndarray]:
        """Return the pose (4, 4) of each link in the root frame."""
        q = np.zeros(self.model.nq)
        for name, joint in zip(self.model.names[1:], self.model.joints[1:], strict=True):
            x = values[name]
            q[joint.idx_q : joint.idx_q + joint.nq] = (np.cos(x), np.sin(x)) if joint.nq > 1 else x
        self.pin.framesForwardKinematics(self.model, self.data, q)
        return {
            f.name: T.homogeneous for f, T in zip(self.model.frames, self.data.oMf, strict=True)
        }


def pose_gap(tree: RandomTree, path, base: str, tip: str, seed: int, poses: int = 2) -> float:
    """Return the largest difference between the link poses of chasles and Pinocchio (m and 1)."""
    from chasles.derive import derive, read
    from chasles.derive.terms.casadi_graph import lower

    robot = read(path, base=base, tip=tip, exact=True)
    fk, links = lower(derive(robot, functions=("fk", "link_poses")).functions, "r")
    oracle, rng = PinocchioTree(tree.urdf), np.random.default_rng(seed)
    gap = 0.0
    for _ in range(poses):
        values = oracle.random(rng)
        expected = oracle.poses(values)
        q = [values[joint.name] for joint in robot.coordinates]
        found = [*np.array(links(q)).reshape(-1, 4, 4), np.array(fk(q)).reshape(4, 4)]
        for name, T in zip([*robot.link_names, tip], found, strict=True):
            gap = max(gap, np.abs(T - np.linalg.inv(expected[base]) @ expected[name]).max())
    return gap
