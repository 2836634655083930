"""Exports (C++, CUDA, MoveIt, MATLAB) agree with the C functions of shipped robots."""

import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import chasles
from chasles.contract.manifest import FunctionInfo
from chasles.derive import write
from chasles.library.compiler import FLAGS
from tests.support import moveit, octave
from tests.support.cpp_driver import FUNCTIONS, compiled_functions, driver, inputs_of
from tests.support.cuda_shim import KINDS, Shim, differing, incomplete
from tests.support.derivations import robot_of
from tests.support.exports import apart, configurations, expected, inverse_of, regular_slots

from .campaign import Campaign, Outcome

ROBOTS = ("ur5e", "panda", "puma560", "excavator", "planar_3rrr", "jaco2")
"""Names of the tested robots, of which planar_3rrr and jaco2 use inverse kinematics solvers in the
shared C files."""
IN_CUDA = ROBOTS[:4]
"""Robots whose CUDA kernels are tested. The inverse kinematics of these robots has no iterative
solver."""
RIGHT_ANGLES = 2_000
PLUGINS = ("ur5e", "panda", "puma560")
"""Robots whose MoveIt plugin is compared with the C functions."""
ROWS = 10_000
EXACT = "-O1 -ffp-contract=off"
"""Compiler flags that disable floating-point contraction, in addition to the default flags.

With floating-point contraction, compilers combine multiplications and additions differently in each
program. Near singular poses, the results would then differ by more than the tolerance.
"""
TOLERANCE = 1e-12
"""Maximum difference between two results, relative for values above 1 and otherwise absolute."""


def trial(number: int) -> Outcome:
    """Compare the exported functions of one robot with its C functions on random inputs."""
    os.environ["CHASLES_CFLAGS"] = EXACT  # the campaign runner restores CHASLES_CFLAGS
    robot = chasles.load(ROBOTS[number % len(ROBOTS)])
    rng, failures = np.random.default_rng(number), []
    finite, largest = 0, 0.0
    with TemporaryDirectory() as folder:
        program = built(robot, Path(folder))
        for info in compiled_functions(robot):
            inputs = inputs_of(robot, info, rng, ROWS)
            found, expected = in_cpp(program, info, inputs), in_c(robot, info, inputs)
            finite += int(np.isfinite(expected).sum())
            worst = difference(found, expected)
            largest = max(largest, worst)
            if worst > TOLERANCE:
                failures.append(f"{robot.name}, {info.name}: differs by {worst:.1e}")
        if robot.name in IN_CUDA:
            failures += in_cuda(robot.name, Path(folder) / "cuda", rng)
        if robot.name in PLUGINS:
            worst, solutions = plugin_difference(robot, Path(folder) / "moveit", rng)
            finite, largest = finite + solutions, max(largest, worst)
            if worst > TOLERANCE:
                failures.append(f"{robot.name}, plugin of MoveIt: differs by {worst:.1e}")
        if shutil.which("octave-cli"):
            os.environ["CHASLES_CFLAGS"] = f"{EXACT} {octave.BASELINE}"
            failures += in_octave(chasles.load(robot.name), Path(folder), rng)
    counts = {"functions": len(compiled_functions(robot)), "finite values": finite}
    return Outcome(counts, tuple(failures), {"difference": largest})


def in_cuda(name: str, folder: Path, rng: np.random.Generator) -> list[str]:
    """Compile the CUDA kernels for the CPU, and return the differences from the C code."""
    shim, failures = Shim(name, folder), []
    q = rng.permutation(configurations(shim.robot, 10 * ROWS))[:ROWS]
    poses = rng.integers(-2, 3, (RIGHT_ANGLES, shim.robot.n)) * (np.pi / 2)
    for kind in KINDS:
        failures += differing(shim, kind, q)
        failures += incomplete(shim, kind, poses) if shim.robot.reference is None else []
    return failures


def plugin_difference(
    robot: chasles.Robot, folder: Path, rng: np.random.Generator
) -> tuple[float, int]:
    """Compare forward kinematics and regular solutions of a MoveIt plugin with the C code.

    Returns the largest difference between plugin and C code, and the number of compared solutions.
    A missing or additional solution counts as an infinite difference.
    """
    package = moveit.exported(robot.name, folder)
    library = moveit.compiled(package, robot.name, tuple(EXACT.split()))
    plugin = moveit.Plugin(library, moveit.model_of(moveit.urdf_of(robot.name), False), robot.n)
    if not plugin.initialize():
        raise AssertionError(plugin.error)
    info = inverse_of(robot)
    q = rng.permutation(configurations(robot, 10 * ROWS))[:ROWS]
    poses = np.array([moveit.to_pose(T) for T in robot.fk(q)])
    T = np.array([moveit.to_transform(pose) for pose in poses])
    exact, residual, _ = expected(robot, info, [T, *(q[:, [k]] for k in info.role.fixed)])
    regular, worst = regular_slots(robot, info, exact, residual), 0.0
    for k, pose in enumerate(poses):
        found, _, _ = plugin.all_solutions(pose, q[k])
        if len(found) != (residual[k] <= moveit.SOLVED).sum():
            return np.inf, 0
        distances = apart(found[:, None], exact[k][None, regular[k]]).max(axis=2)
        forward = np.abs(plugin.forward("ee", q[k]) - robot.fk(q[k])).max()
        worst = max(worst, forward, distances.min(axis=0).max(initial=0.0))
    return float(worst), int(regular.sum())


def in_octave(robot: chasles.Robot, folder: Path, rng: np.random.Generator) -> list[str]:
    """Call the MATLAB functions in Octave, and describe their differences from the C code."""
    octave.exported(robot, folder)
    infos = [info for info in robot.manifest.functions if info.name in octave.FUNCTIONS]
    inputs = {info.name: inputs_of(robot, info, rng, ROWS) for info in infos}
    script = [octave.make(robot.name)]
    script += [octave.call(robot.name, info, inputs[info.name], folder) for info in infos]
    solved = [info for info in infos if info.role.is_inverse and robot.reference is None]
    q = rng.integers(-2, 3, (RIGHT_ANGLES, robot.n)) * (np.pi / 2)
    at_right_angles = {f.name: [robot.fk(q), *(q[:, k] for k in f.role.fixed)] for f in solved}
    script += [octave.call(robot.name, f, at_right_angles[f.name], folder, "_r") for f in solved]
    octave.octave("\n".join(script), folder)
    failures = []
    for info in infos:
        found = octave.results(info, ROWS, folder)
        if info.role.is_inverse:
            worst, _ = octave.difference_of_solutions(robot, inputs[info.name], found)
        else:
            exact = robot.functions[info.name].ufunc(*inputs[info.name])
            parts = exact if isinstance(exact, tuple) else (exact,)
            worst = max(
                difference(x, y.reshape(x.shape)) for x, y in zip(found, parts, strict=True)
            )
        if worst > TOLERANCE:
            failures.append(f"{robot.name}, {info.name} in Octave: differs by {worst:.1e}")
    for info in solved:
        found = octave.results(info, RIGHT_ANGLES, folder, "_r")
        missing = octave.missing_solutions(robot, at_right_angles[info.name], found)
        if missing:
            failures.append(f"{robot.name}, {info.name} in Octave: {missing} solutions missing")
    return failures


def difference(found: np.ndarray, expected: np.ndarray) -> float:
    """Compare two arrays.

    Returns the largest difference between the two arrays, relative for values above 1 and otherwise
    absolute. If only one of two compared values is NaN or infinite, the returned difference is
    infinite.
    """
    is_same = (found == expected) | (np.isnan(found) & np.isnan(expected))
    relative = np.abs(found - expected) / np.maximum(1, np.abs(expected))
    return float(np.max(np.nan_to_num(relative, nan=np.inf), where=~is_same, initial=0.0))


def built(robot: chasles.Robot, folder: Path) -> Path:
    """Compile the C++ package of a robot with a program that calls its functions."""
    functions = sorted(FUNCTIONS & set(robot.functions))
    write(robot_of(robot.name), folder, functions=functions, languages=["cpp"])
    (folder / "driver.cpp").write_text(driver(robot.name))
    places = [f"-I{folder / part}" for part in ("include", "include/chasles", "src")]
    defaults = [flag for flag in FLAGS if flag not in ("-std=c99", "-shared")]
    flags = [*defaults, *EXACT.split(), *places]
    c = ["gcc", "-std=c99", *flags, "-c", f"src/{robot.name}.c", "-o", "robot.o"]
    cpp = ["g++", "-std=c++17", *flags, "driver.cpp", "robot.o", "-lm", "-o", "driver"]
    for command in (c, cpp):
        subprocess.run(command, cwd=folder, check=True)
    return folder / "driver"


def in_cpp(program: Path, info: FunctionInfo, inputs: Sequence[np.ndarray]) -> np.ndarray:
    """Return the outputs of a C++ function as a flat list, row by row."""
    rows = np.hstack([item.reshape(len(item), -1) for item in inputs]).tobytes()
    done = subprocess.run([program, info.name], input=rows, capture_output=True, check=True)
    return np.frombuffer(done.stdout).reshape(len(inputs[0]), -1)


def in_c(robot: chasles.Robot, info: FunctionInfo, inputs: Sequence[np.ndarray]) -> np.ndarray:
    """Return the outputs of a C function as a flat list, row by row."""
    function = robot.functions[info.name].ufunc
    results = (function(*row) for row in zip(*inputs, strict=True))
    as_tuples = (item if isinstance(item, tuple) else (item,) for item in results)
    return np.array([np.concatenate([np.ravel(part) for part in item]) for item in as_tuples])


CAMPAIGN = Campaign(
    "exports",
    "Exported C++, CUDA kernels, plugins and MATLAB functions equal the C of a robot to 1e-12.",
    trial,
)
