"""URDF variants of one arm, as different exporters would write them.

In all variants, the joint axes are equal except for rounding and added noise.
"""

import random
from collections.abc import Callable
from dataclasses import dataclass, replace
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

import numpy as np

from chasles.derive import SerialRobot
from chasles.derive.chain.poe import placement_matrix

Texts = tuple[str, str, str]
ZEROS: Texts = ("0", "0", "0")
FEWEST_DIGITS, MAX_DIGITS = 3, 6
SMALLEST_NOISE, LARGEST_NOISE = -16, -9
"""Decimal exponents of the noise that a mutation adds to lengths (meter), angles (radian) and other
numbers."""
ODD_NAMES = ("{} link", "2{}", "{}-axis", "arm/{}", "{}.joint", "x_{}")
MAX_TURNED, MAX_INSERTED = 3, 3


@dataclass(frozen=True)
class UrdfJoint:
    """A joint of a chain, with the numbers written in the URDF file."""

    name: str
    kind: str
    xyz: Texts = ZEROS
    rpy: Texts = ZEROS
    axis: Texts = ("0", "0", "1")
    limits: tuple[str, str] | None = None

    @property
    def origin(self) -> np.ndarray:
        """Joint frame (4, 4) relative to the preceding link."""
        T = np.eye(4)
        T[:3, :3] = rotation(*map(float, self.rpy))
        T[:3, 3] = [float(x) for x in self.xyz]
        return T

    def placed(self, T: np.ndarray) -> "UrdfJoint":
        return replace(self, xyz=texts(T[:3, 3]), rpy=texts(rpy_of(T[:3, :3])))


@dataclass(frozen=True)
class Mutant:
    """A URDF of a chain, with the list of its mutations.

    Attributes:
        arm: Name of the arm.
        joints: The joints, ordered from the base.
        made: Names of the applied mutations.
    """

    arm: str
    joints: tuple[UrdfJoint, ...]
    made: tuple[str, ...] = ()

    @property
    def tip(self) -> str:
        return f"l{len(self.joints)}"

    @property
    def text(self) -> str:
        parts = [f"<robot name={quoteattr(self.arm)}>", '<link name="l0"/>']
        for k, joint in enumerate(self.joints, 1):
            limits = ""
            if joint.limits:
                lower, upper = joint.limits
                limits = f'<limit lower="{lower}" upper="{upper}" effort="1" velocity="1"/>'
            parts += [
                f'<link name="l{k}"/>',
                f'<joint name={quoteattr(joint.name)} type="{joint.kind}">'
                f'<parent link="l{k - 1}"/><child link="l{k}"/>'
                f'<origin xyz="{" ".join(joint.xyz)}" rpy="{" ".join(joint.rpy)}"/>'
                f'<axis xyz="{" ".join(joint.axis)}"/>{limits}</joint>',
            ]
        return "\n".join([*parts, "</robot>"])


def arm_of_urdf(name: str, text: str) -> Mutant:
    """Parse the chain of a URDF that contains only one chain, and keep the numbers as written."""
    joints = []
    for element in ElementTree.fromstring(text).findall("joint"):
        found = {
            tag: part.attrib for tag in ("origin", "axis", "limit") for part in element.findall(tag)
        }
        limit = found.get("limit")
        joints.append(
            UrdfJoint(
                element.get("name", ""),
                element.get("type", ""),
                three(found.get("origin", {}).get("xyz", "0 0 0")),
                three(found.get("origin", {}).get("rpy", "0 0 0")),
                three(found.get("axis", {}).get("xyz", "1 0 0")),
                (limit["lower"], limit["upper"]) if limit else None,
            )
        )
    return Mutant(name, tuple(joints))


def arm_of_robot(robot: SerialRobot) -> Mutant:
    """Convert a serial robot with revolute and prismatic joints to URDF in double precision."""
    values = {parameter.symbol: parameter.value for parameter in robot.parameters}

    def pose(placement: object) -> np.ndarray:
        return np.array(placement_matrix(placement).xreplace(values).evalf(20), float)

    joints, carried = [], pose(robot.base)
    for joint in robot.joints:
        at = carried @ pose(joint.before)
        carried = pose(joint.after)
        if joint.kind == "fixed":
            carried = at @ carried
            continue
        limits = None if None in joint.limits else tuple(repr(float(x)) for x in joint.limits)
        kind = joint.kind if limits or joint.kind == "prismatic" else "continuous"
        limits = limits or (("-1.0", "1.0") if kind == "prismatic" else None)
        axis = ("0", "0", "-1" if joint.direction == -1 else "1")
        joints.append(UrdfJoint(joint.name, kind, axis=axis, limits=limits).placed(at))
    joints.append(UrdfJoint("to_tool_frame", "fixed").placed(carried @ pose(robot.tool)))
    return Mutant(robot.name, tuple(joints))


def mutated(arm: Mutant, seed: int) -> Mutant:
    """Return an arm with one to four random changes of its description."""
    dice = random.Random(f"{arm.arm} {seed}")
    chosen = dice.sample(sorted(MUTATIONS), dice.randint(1, 4))
    rewriting = [name for name in chosen if name in ("noise", "single precision", "digits")]
    for name in rewriting[1:]:
        chosen.remove(name)
    result = arm
    for name in (name for name in MUTATIONS if name in chosen):
        result = replace(MUTATIONS[name](result, dice), made=(*result.made, name))
    return result


def right_angles(mutant: Mutant, dice: random.Random) -> Mutant:
    """Rotate some link frames by right angles about their origins."""
    joints = list(mutant.joints)
    for _ in range(dice.randint(1, MAX_TURNED)):
        k = dice.randrange(len(joints) - 1)
        quarters = (dice.randrange(4) for _ in range(3))
        turn = np.eye(4)
        turn[:3, :3] = np.round(rotation(*(np.pi / 2 * quarter for quarter in quarters)))
        joint, following = joints[k], joints[k + 1]
        axis = turn[:3, :3].T @ [float(x) for x in joint.axis]
        joints[k] = replace(joint.placed(joint.origin @ turn), axis=texts(axis))
        joints[k + 1] = following.placed(turn.T @ following.origin)
    return replace(mutant, joints=tuple(joints))


def fixed_joints(mutant: Mutant, dice: random.Random) -> Mutant:
    """Insert fixed joints.

    The translation of a joint may be moved to an inserted fixed joint.
    """
    joints = list(mutant.joints)
    for n in range(dice.randint(1, MAX_INSERTED)):
        k = dice.randrange(len(joints))
        fixed = UrdfJoint(f"mount_{n}", "fixed")
        if dice.random() < 0.5:
            fixed = replace(fixed, xyz=joints[k].xyz)
            joints[k] = replace(joints[k], xyz=ZEROS)
        joints.insert(k, fixed)
    return replace(mutant, joints=tuple(joints))


def flipped(mutant: Mutant, dice: random.Random) -> Mutant:
    def turned(joint: UrdfJoint) -> UrdfJoint:
        if dice.random() < 0.5:
            return joint
        x, y, z = (negative(component) for component in joint.axis)
        return replace(joint, axis=(x, y, z))

    return replace(mutant, joints=tuple(turned(joint) for joint in mutant.joints))


def renamed(mutant: Mutant, dice: random.Random) -> Mutant:
    """Replace joint names by names that are not valid names in C."""
    joints = enumerate(mutant.joints)
    names = [dice.choice(ODD_NAMES).format(f"j{k}") for k, _ in joints]
    pairs = zip(mutant.joints, names, strict=True)
    return replace(mutant, joints=tuple(replace(joint, name=name) for joint, name in pairs))


def noise(mutant: Mutant, dice: random.Random) -> Mutant:
    """Add noise between 1e-16 and 1e-9 to all numbers."""

    def noisy(text: str) -> str:
        size = 10 ** dice.uniform(SMALLEST_NOISE, LARGEST_NOISE)
        return repr(float(text) + dice.choice((-1, 1)) * size)

    return rewritten(mutant, noisy)


def single_precision(mutant: Mutant, _: random.Random) -> Mutant:
    """Round numbers to single precision, but write all digits of a double."""
    return rewritten(mutant, lambda text: repr(float(np.float32(float(text)))))


def digits(mutant: Mutant, dice: random.Random) -> Mutant:
    """Round all numbers to a random number of significant digits, between three and six."""
    count = dice.randint(FEWEST_DIGITS, MAX_DIGITS)
    return rewritten(mutant, lambda text: f"{float(text):.{count}g}")


MUTATIONS: dict[str, Callable[[Mutant, random.Random], Mutant]] = {
    "right angles": right_angles,
    "fixed joints": fixed_joints,
    "flipped": flipped,
    "renamed": renamed,
    "noise": noise,
    "single precision": single_precision,
    "digits": digits,
}
"""All mutations, in the order of application."""


def rewritten(mutant: Mutant, change: Callable[[str], str]) -> Mutant:
    def each(vector: Texts) -> Texts:
        x, y, z = map(change, vector)
        return x, y, z

    return replace(
        mutant,
        joints=tuple(
            replace(joint, xyz=each(joint.xyz), rpy=each(joint.rpy), axis=each(joint.axis))
            for joint in mutant.joints
        ),
    )


def rotation(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Return Rz(yaw) Ry(pitch) Rx(roll)."""
    (cr, cp, cy), (sr, sn, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    Rx = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    Ry = np.array([[cp, 0, sn], [0, 1, 0], [-sn, 0, cp]])
    Rz = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return Rz @ Ry @ Rx


def rpy_of(R: np.ndarray) -> tuple[float, float, float]:
    """Return roll, pitch and yaw of a rotation. At pitch +-90 degrees, roll is 0."""
    level = np.hypot(R[0, 0], R[1, 0])
    pitch = np.arctan2(-R[2, 0], level)
    if level < 1e-9:
        return 0.0, float(pitch), float(np.arctan2(-R[0, 1], R[1, 1]))
    return float(np.arctan2(R[2, 1], R[2, 2])), float(pitch), float(np.arctan2(R[1, 0], R[0, 0]))


def texts(vector: np.ndarray) -> Texts:
    x, y, z = (repr(float(number)) for number in vector)
    return x, y, z


def three(text: str) -> Texts:
    x, y, z = text.split()
    return x, y, z


def negative(text: str) -> str:
    return text[1:] if text.startswith("-") else f"-{text}"
