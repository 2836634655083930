"""Compiles an exported MoveIt plugin against stubs, and calls the plugin through its base class.

MoveIt itself is not installed, and the stubs declare only those parts of MoveIt that the plugin
needs.
"""

import ctypes
import hashlib
import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from chasles.derive import convert, write
from chasles.derive.model.mechanism import Mechanism
from tests.support.derivations import robot_of
from tests.support.locking import locked
from tests.support.native import BUILD

STUBS = Path(__file__).parent
WARNINGS = ("-Wall", "-Wextra", "-Werror", "-Wconversion", "-Wshadow", "-Wpedantic")
COMPILER = "clang++" if shutil.which("clang++") else "g++"
"""C++ compiler, clang++ if available: Clang compiles Eigen at -O0 in half the time of GCC."""
PRECOMPILED = "pch" if shutil.which("clang++") else "gch"
"""File suffix of a precompiled header, which the compiler finds next to the header."""
INSTANTIATED = ("-fpch-instantiate-templates",) if shutil.which("clang++") else ()
EIGEN_FOLDER = Path("/usr/include/eigen3")
EIGEN = ("-isystem", str(EIGEN_FOLDER))
BASE, TIP = "world", "tcp"
"""Names of the base link and the tip link of the robot model."""
BASE_OFFSET = ("0.3 -0.2 0.9", "0.1 0.4 -0.7")
TIP_OFFSET = ("0.05 0 0.12", "0.3 -0.2 0.5")
SUCCESS, TIMED_OUT, NO_SOLUTION = 1, -6, -31
"""Error codes of MoveIt."""
NO_DISCRETIZATION, ALL_DISCRETIZED, SOME_DISCRETIZED, ALL_RANDOM = 1, 2, 3, 4
OK, UNSUPPORTED, MULTIPLE_TIPS, EMPTY, NOT_ACTIVE, NONE = 1, 2, 4, 5, 7, 8
"""Values of MoveIt's enumeration `KinematicError`."""
CAPACITY = 10_000
SOLVED = 1e-9
"""Maximum residual of an inverse kinematics solution."""
ACCEPT = ctypes.CFUNCTYPE(ctypes.c_bool, ctypes.POINTER(ctypes.c_double))


def exported(name: str, folder: Path) -> Path:
    maps = ["chain", "chain_D_q", "chain_rates", "actuators", "actuators_D_chain"]
    maps += ["actuator_rates", "configuration"]
    robot = robot_of(name)
    functions = ["fk", "ik", *(maps if isinstance(robot, Mechanism) else ())]
    write(robot, folder, functions=functions, languages=["moveit"])
    return folder


def compiled(package: Path, name: str, flags: tuple[str, ...] = ("-O0",)) -> Path:
    """Compile the MoveIt plugin of a package and the bridge to Python.

    The same source is compiled only once, and concurrent processes wait for this compilation.
    """
    include = package / "include" / f"chasles_{name}_moveit"
    sources = [*sorted((package / "src").glob("*.cpp")), STUBS / "bridge.cpp"]
    files = [*sources, *package.glob("src/*.[ch]*"), *include.iterdir(), *STUBS.rglob("*.hpp")]
    texts = [COMPILER, *flags, *(file.read_text() for file in sorted({*files}))]
    digest = hashlib.sha256("\0".join(texts).encode()).hexdigest()
    library = BUILD / f"moveit-{name}-{digest[:16]}.so"
    places = ["-I", str(STUBS / "include"), "-I", str(include), "-I", str(package / "src")]
    shared = [*flags, "-fPIC", *places]
    c = ["gcc", "-std=c99", *shared, "-c", f"src/{name}.c", "-o", "robot.o"]
    unit = "".join(f'#include "{source}"\n' for source in sources)
    cpp = [COMPILER, "-std=c++17", "-include", _stubs(flags), *shared, *WARNINGS, *EIGEN]
    cpp += ["-shared", "unit.cpp", "robot.o"]
    with locked(library):
        missing = not library.exists()
        (package / "unit.cpp").write_text(unit)
        for command in (c, [*cpp, "-lm", "-o", "plugin.so"]) if missing else ():
            done = subprocess.run(command, cwd=package, capture_output=True, text=True, check=False)
            assert done.returncode == 0, done.stderr
        if missing:
            shutil.move(package / "plugin.so", library)
    return library


def _stubs(flags: tuple[str, ...]) -> Path:
    """Return a header with Eigen and all MoveIt stubs, precompiled once for all plugins."""
    headers = sorted((STUBS / "include").rglob("*.hpp"))
    text = "".join(f'#include "{header}"\n' for header in headers)
    words = [COMPILER, *flags, text, *(header.read_text() for header in headers)]
    digest = hashlib.sha256("\0".join(words).encode()).hexdigest()
    stubs = BUILD / f"moveit-stubs-{digest[:16]}.hpp"
    made, compiled_stubs = stubs.with_suffix(".new"), stubs.with_suffix(f".hpp.{PRECOMPILED}")
    command = [COMPILER, "-std=c++17", *flags, "-fPIC", "-I", STUBS / "include", *WARNINGS]
    command += [*EIGEN, *INSTANTIATED, "-x", "c++-header", stubs, "-o", made]
    with locked(stubs):
        if not compiled_stubs.exists():
            stubs.write_text(text)
            subprocess.run(command, check=True)
            made.rename(compiled_stubs)
    return stubs


def urdf_of(name: str) -> str:
    robot = robot_of(name)
    text = convert(robot.main_chain if isinstance(robot, Mechanism) else robot, "urdf").text
    base = re.search(r'<link name="(\w+)"', text)[1]
    links = "".join(f'<link name="{link}"/>' for link in (BASE, TIP))
    ends = links + _fixed(BASE, base, BASE_OFFSET) + _fixed("ee", TIP, TIP_OFFSET)
    text = text.replace('"tip"', '"ee"').replace("tip_joint", "ee_joint")
    return text.replace("</robot>", f"{ends}</robot>").replace(f'"{base}"', '"base"')


def _fixed(parent: str, child: str, offset: tuple[str, str]) -> str:
    xyz, rpy = offset
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    origin = f'<origin xyz="{xyz}" rpy="{rpy}"/>'
    return f'<joint name="{parent}_{child}" type="fixed">{origin}{ends}</joint>'


def model_of(urdf: str, has_limits: bool = True) -> str:
    """Return the robot model of a URDF text as text lines for the MoveIt stub."""
    lines = []
    for joint in ET.fromstring(urdf).iter("joint"):
        axis, limit = joint.find("axis"), joint.find("limit")
        words = [joint.get("name"), joint.get("type").replace("continuous", "revolute")]
        words += [joint.find("parent").get("link"), joint.find("child").get("link")]
        numbers = [*map(repr, _origin(joint).ravel().tolist())]
        numbers += (axis.get("xyz") if axis is not None else "0 0 1").split()
        if limit is None or not has_limits:
            numbers += ["0", "0", "0"]
        else:
            numbers += [limit.get("lower"), limit.get("upper"), "1"]
        mimic = joint.find("mimic")
        follows = ["-", "0"] if mimic is None else [mimic.get("joint"), mimic.get("multiplier")]
        lines.append(" ".join(words + numbers + follows))
    return "\n".join(lines)


def _origin(joint: ET.Element) -> np.ndarray:
    origin = joint.find("origin")
    if origin is None:
        return np.eye(4)
    return transform(origin.get("xyz"), origin.get("rpy"))


def transform(xyz: str, rpy: str) -> np.ndarray:
    r, p, y = (float(word) for word in rpy.split())
    T = np.eye(4)
    T[:3, :3] = _turn(2, y) @ _turn(1, p) @ _turn(0, r)
    T[:3, 3] = [float(word) for word in xyz.split()]
    return T


def _turn(axis: int, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    j, k = (axis + 1) % 3, (axis + 2) % 3
    R = np.eye(3)
    R[j, j] = R[k, k] = c
    R[j, k], R[k, j] = -s, s
    return R


def to_pose(T: np.ndarray) -> np.ndarray:
    """Return position and unit quaternion (x, y, z, w) of a transform."""
    R = T[:3, :3]
    K = np.array(
        [
            [R[0, 0] - R[1, 1] - R[2, 2], 0, 0, 0],
            [R[1, 0] + R[0, 1], R[1, 1] - R[0, 0] - R[2, 2], 0, 0],
            [R[2, 0] + R[0, 2], R[2, 1] + R[1, 2], R[2, 2] - R[0, 0] - R[1, 1], 0],
            [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], np.trace(R)],
        ]
    )
    return np.concatenate([T[:3, 3], np.linalg.eigh(K)[1][:, -1]])


def to_transform(pose: np.ndarray) -> np.ndarray:
    """Return the transform (4, 4) of a position and a quaternion (x, y, z, w)."""
    x, y, z, w = pose[3:] / np.linalg.norm(pose[3:])
    T = np.eye(4)
    T[:3, 3] = pose[:3]
    T[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return T


@dataclass
class Plugin:
    """An instance of the MoveIt plugin for a robot model.

    Attributes:
        library: Path of the compiled plugin.
        model: Lines of the robot model, as the MoveIt stub reads them.
        n: Number of joints.
        parameters: Values of the ROS parameters of the joint group, keyed by name.
    """

    library: Path
    model: str
    n: int
    parameters: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._c = ctypes.CDLL(str(self.library))
        self._c.create.restype = ctypes.c_void_p
        for name in ("last_error", "names"):
            getattr(self._c, name).restype = ctypes.c_char_p
        for name in ("initialize", "nearest", "search", "forward", "set_redundant"):
            getattr(self._c, name).restype = ctypes.c_bool
        self._plugin = ctypes.c_void_p(self._c.create(self.model.encode()))
        for name, value in self.parameters.items():
            self._c.set_parameter(self._plugin, name.encode(), value.encode())

    def initialize(self, base="base", tip="ee", group="arm", step=0.1) -> bool:
        words = (word.encode() for word in (group, base, tip))
        return self._c.initialize(self._plugin, *words, ctypes.c_double(step))

    @property
    def error(self) -> str:
        return self._c.last_error().decode()

    def names(self, *, links: bool) -> list[str]:
        return self._c.names(self._plugin, links).decode().split()

    def set_redundant(self, joint: int) -> bool:
        return self._c.set_redundant(self._plugin, joint)

    def nearest(self, pose, seed) -> tuple[np.ndarray | None, int]:
        theta, code = np.empty(self.n), ctypes.c_int()
        done = self._c.nearest(
            self._plugin, _row(pose), _row(seed), _row(theta), ctypes.byref(code)
        )
        return (theta if done else None), code.value

    def all_solutions(self, pose, seed, method=NO_DISCRETIZATION, poses=1):
        """Return (solutions, solution percentage, kinematic error)."""
        theta, percentage, error = (
            np.empty((CAPACITY, self.n)),
            ctypes.c_double(),
            ctypes.c_int(),
        )
        outputs = (_row(theta), ctypes.byref(percentage), ctypes.byref(error))
        count = self._c.all_solutions(self._plugin, poses, _row(pose), _row(seed), method, *outputs)
        return theta[:count], percentage.value, error.value

    def search(
        self,
        pose,
        seed,
        timeout=10.0,
        limits=None,
        accept=None,
        as_list=False,
        locked=False,
    ):
        """Return an inverse kinematics solution or None, and the error code of MoveIt."""
        theta, code = np.empty(self.n), ctypes.c_int()
        callback = ACCEPT(lambda q: accept(np.array(q[: self.n]))) if accept else ACCEPT()
        inputs = (_row(pose), _row(seed), ctypes.c_double(timeout), _row(limits))
        outputs = (_row(theta), ctypes.byref(code))
        done = self._c.search(self._plugin, as_list, *inputs, callback, locked, *outputs)
        return (theta if done else None), code.value

    def forward(self, link, theta) -> np.ndarray | None:
        pose = np.empty(7)
        done = self._c.forward(self._plugin, link.encode(), _row(theta), _row(pose))
        return to_transform(pose) if done else None


def _row(values):
    if values is None:
        return None
    array = values if isinstance(values, np.ndarray) else np.array(values, float)
    array = array if array.flags.c_contiguous and array.dtype == float else array.astype(float)
    return np.ctypeslib.as_ctypes(array)
