"""Real arms: the geometry of 72 arms from the ssik package, and a factory calibration.

Each arm becomes a URDF with its original, noisy numbers. NumPy computes test poses from the
original numbers.
"""

import importlib
import importlib.util
import json
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from types import ModuleType

import numpy as np

import chasles
from chasles.contract import read_manifest
from chasles.derive import read
from tests.support.generators.poses import Case
from tests.support.oracles.screws import Screws, screws_of

CALIBRATION = Path(__file__).parents[1] / "ur5_factory_calibration.json"
UPRIGHT = 1e-9
"""If the cosine of the pitch is below this value, roll and yaw rotate about the same axis."""


@dataclass(frozen=True)
class FieldArm:
    """A numeric chain of revolute joints.

    Attributes:
        name: Manufacturer and model.
        before: (n, 4, 4) constant placement from the previous link to each joint.
        axes: (n, 3) axis of each joint in the joint frame.
        after: (n, 4, 4) constant placement from each joint to its link.
    """

    name: str
    before: np.ndarray
    axes: np.ndarray
    after: np.ndarray

    def urdf(self) -> str:
        """Return the arm as a URDF with full double precision."""
        lines = [f'<robot name="{self.name}">', '<link name="base"/>']
        last = len(self.axes) - 1
        for k, (T, axis, back) in enumerate(zip(self.before, self.axes, self.after, strict=True)):
            parent, link = ("base" if k == 0 else f"link_{k}"), f"link_{k + 1}"
            turned = f"turned_{k + 1}" if not np.array_equal(back, np.eye(4)) else link
            lines += [f'<link name="{turned}"/>']
            lines += [_joint(f"joint_{k + 1}", "continuous", parent, turned, T, axis)]
            if turned != link:
                lines += [f'<link name="{link}"/>']
                lines += [_joint(f"end_{k + 1}", "fixed", turned, link, back)]
            assert k < last or link == f"link_{last + 1}"
        return "\n".join([*lines, "</robot>", ""])

    @cached_property
    def screws(self) -> Screws:
        """Joint axes and home pose in the base frame [m]."""
        frame, axes, points = np.eye(4), [], []
        for T, axis, back in zip(self.before, self.axes, self.after, strict=True):
            frame = frame @ T
            h = frame[:3, :3] @ (axis / np.linalg.norm(axis))
            axes.append(h)
            points.append(frame[:3, 3] - (frame[:3, 3] @ h) * h)
            frame = frame @ back
        return Screws(np.array(axes), np.array(points), np.zeros((len(axes), 3)), frame)


@dataclass(frozen=True)
class FieldCase(Case):
    """A benchmark case of a real arm.

    The generated code is in a folder with the name of the arm.

    Attributes:
        arm: The numeric chain.
        folder: The folder of the generated files.
    """

    arm: FieldArm = field(kw_only=True)
    folder: Path = field(kw_only=True)

    @cached_property
    def robot(self) -> chasles.Robot:
        return chasles.load(self.folder)

    @property
    def method(self) -> str:
        """Inverse kinematics method of the arm: exact, refined or general."""
        return read_manifest(self.folder).inverse.method

    @cached_property
    def screws(self) -> Screws:
        """Screw axes of the arm from its noise-free URDF file."""
        return screws_of(read(self.folder.parent / f"{self.name}.urdf"))

    def has_value(self, name: str) -> bool:
        """Whether the redundancy parameter ``name`` can be computed from a configuration."""
        return name in self.robot.functions or self.coordinate(name) is not None


def arms() -> Iterator[FieldArm]:
    """Yield all arms of the ssik package, then the factory calibration of a UR5."""
    for module in prebuilt().values():
        yield from_ssik(module)
    yield calibrated()


def prebuilt() -> dict[str, ModuleType]:
    if importlib.util.find_spec("ssik") is None:
        return {}
    package = importlib.import_module("ssik.prebuilt")
    root = Path(str(package.__file__)).parent
    return {
        f"{path.parent.name}_{path.stem.removesuffix('_ik')}": importlib.import_module(
            f"ssik.prebuilt.{path.parent.name}.{path.stem}"
        )
        for path in sorted(root.glob("*/*_ik.py"))
    }


def from_ssik(module: ModuleType) -> FieldArm:
    maker, model = module.__name__.split(".")[-2:]
    return FieldArm(
        f"{maker}_{model.removesuffix('_ik')}",
        np.array(module._JOINT_T_LEFTS),
        np.array(module._JOINT_AXES),
        np.array(module._JOINT_T_RIGHTS),
    )


def calibrated(path: Path = CALIBRATION) -> FieldArm:
    """Return the arm of a factory calibration: six fixed transforms, each before a z rotation."""
    links = json.loads(path.read_text(encoding="utf-8"))["kinematics"].values()
    before = np.array([_pose(link) for link in links])
    count = len(before)
    return FieldArm(
        "universal_robots_ur5_calibrated",
        before,
        np.tile([0.0, 0.0, 1.0], (count, 1)),
        np.tile(np.eye(4), (count, 1, 1)),
    )


def derived(arm: FieldArm, folder: Path) -> None:
    """Derive an arm's URDF in a separate process.

    Raises:
        RuntimeError: The derivation failed. The message is the last line that the derivation
            printed.
    """
    folder.mkdir(parents=True, exist_ok=True)
    source = folder / f"{arm.name}.urdf"
    source.write_text(arm.urdf(), encoding="utf-8")
    command = [sys.executable, "-c", _DERIVE, str(source), str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError((done.stdout + done.stderr).strip().splitlines()[-1])


_DERIVE = """
import sys
from pathlib import Path
from chasles.derive import read, write
robot = read(sys.argv[1])
write(robot, Path(sys.argv[2]) / robot.name)
"""


def _joint(
    name: str, kind: str, parent: str, child: str, T: np.ndarray, axis: np.ndarray | None = None
) -> str:
    x, y, z = (repr(float(value)) for value in T[:3, 3])
    roll, pitch, yaw = (repr(value) for value in _angles(T[:3, :3]))
    about = "" if axis is None else f'<axis xyz="{" ".join(repr(float(v)) for v in axis)}"/>'
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{x} {y} {z}" rpy="{roll} {pitch} {yaw}"/>{about}</joint>'
    )


def _angles(R: np.ndarray) -> tuple[float, float, float]:
    """Return roll, pitch and yaw with R = Rz(yaw) Ry(pitch) Rx(roll)."""
    level = float(np.hypot(R[0, 0], R[1, 0]))
    pitch = float(np.arctan2(-R[2, 0], level))
    if level > UPRIGHT:
        return float(np.arctan2(R[2, 1], R[2, 2])), pitch, float(np.arctan2(R[1, 0], R[0, 0]))
    return float(np.arctan2(-R[1, 2], R[1, 1])), pitch, 0.0


def _pose(link: dict[str, float]) -> np.ndarray:
    T = np.eye(4)
    for axis, angle in ((2, link["yaw"]), (1, link["pitch"]), (0, link["roll"])):
        c, s = np.cos(angle), np.sin(angle)
        turn = np.eye(4)
        i, k = [(1, 2), (2, 0), (0, 1)][axis]
        turn[i, i] = turn[k, k] = c
        turn[i, k], turn[k, i] = -s, s
        T = T @ turn
    T[:3, 3] = link["x"], link["y"], link["z"]
    return T
