"""Compiles exported MATLAB functions with Octave, and evaluates these functions for many inputs."""

import platform
import subprocess
from pathlib import Path

import numpy as np

from chasles.derive import write
from tests.support.derivations import robot_of
from tests.support.exports import apart, inverse_of, regular_slots

FUNCTIONS = {"fk", "fk_jacobian_mixed", "hessian_mixed", "ik", "chain", "actuators", "chain_all"}
"""Names of the functions whose results in Octave are compared with the generated C code."""
BASELINE = "-march=x86-64" if platform.machine() == "x86_64" else ""
"""Compiler flag for the baseline instruction set, which the exported MATLAB functions use."""
SOLVED = 1e-9
"""Maximum residual of a valid solution (m or rad)."""
POSE_ERROR = 1e-9
"""Maximum difference between an entry of a target pose and the same entry of the pose that a
solution reaches."""


def exported(robot, folder: Path) -> Path:
    functions = sorted(FUNCTIONS & set(robot.functions))
    write(robot_of(robot.name), folder / robot.name, functions=functions, languages=["mex"])
    return folder / robot.name


def octave(script: str, folder: Path) -> str:
    """Run an Octave script in a folder, and return its printed text."""
    command = ["octave-cli", "--no-history", "--quiet", "--norc", "--eval", script]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def make(name: str) -> str:
    """Return the MATLAB statements that compile the exported functions of a robot."""
    return f"addpath('{name}'); make_chasles_{name};\n"


def call(name: str, info, inputs, folder: Path, suffix: str = "") -> str:
    """Write the inputs of a function, and return the MATLAB statements that call the function."""
    stem, statements, arguments = f"{info.name}{suffix}", [], []
    for k, (item, values) in enumerate(zip(info.inputs, inputs, strict=True)):
        sizes = [*(item.shape or (1,)), len(values)]
        columns = np.moveaxis(np.reshape(values, (len(values), *sizes[:-1])), 0, -1)
        columns.ravel(order="F").tofile(folder / f"{stem}_{k}.in")
        read = f"fread(fopen('{stem}_{k}.in'), Inf, 'double')"
        statements.append(f"x{k} = reshape({read}, {sizes});")
        arguments.append(f"x{k}")
    names = [f"y{k}" for k in range(_count(info))]
    statements.append(f"[{', '.join(names)}] = {name}_{info.name}({', '.join(arguments)});")
    statements += [f"fwrite(fopen('{stem}_{y}.out', 'w'), {y}, 'double');" for y in names]
    return "\n".join([*statements, "fclose('all');", ""])


def results(info, count: int, folder: Path, suffix: str = "") -> list[np.ndarray]:
    """Return the outputs of a MATLAB call in the array layout of the Python functions."""
    shapes = [item.shape or (1,) for item in info.outputs]
    if info.role.is_inverse:
        shapes.insert(1, shapes[1])
    found = []
    for k, shape in enumerate(shapes):
        values = np.fromfile(folder / f"{info.name}{suffix}_y{k}.out")
        is_slots = info.role.has_slots and len(shape) > 1
        sizes = shape[::-1] if is_slots else shape
        columns = np.moveaxis(values.reshape((*sizes, count), order="F"), -1, 0)
        found.append(np.swapaxes(columns, 1, 2) if is_slots else columns)
    return found


def _count(info) -> int:
    return len(info.outputs) + info.role.is_inverse


def difference_of_solutions(robot, inputs, found) -> tuple[float, int]:
    """Compare Octave solutions with the solutions of the generated C code.

    Only solutions away from singularities are compared. Returns (largest difference, number of
    compared solutions). The difference is infinite if a solution is valid only in Octave or only in
    C, or if a solution does not reach its pose.
    """
    q, valid = found[0], found[1] == 1
    exact, residual = _pose_by_pose(robot, inputs)
    regular = regular_slots(robot, inverse_of(robot), exact, residual)
    if (valid != (residual <= SOLVED)).any():
        return np.inf, 0
    T = np.broadcast_to(inputs[0][:, None], (*valid.shape, 4, 4))[valid]
    if np.abs(robot.fk(q[valid]) - T).max() > POSE_ERROR:
        return np.inf, 0
    return float(apart(q, exact)[regular].max(initial=0)), int(regular.sum())


def _pose_by_pose(robot, inputs):
    """Return the solutions and residuals of the C code, computed pose by pose.

    The exported MATLAB functions also call the C code pose by pose. For batches of poses, the C
    code adds numbers in a different order.
    """
    solved = [robot.functions["ik"].ufunc(*row) for row in zip(*inputs, strict=True)]
    return np.array([q for q, _, _ in solved]), np.array([residual for _, residual, _ in solved])


def missing_solutions(robot, inputs, found) -> int:
    """Count solutions of the C code that are missing in `found`, and poses without a solution in
    `found`.

    A solution that does not reach its pose counts as missing.
    """
    q, valid = found[0], found[1] == 1
    exact, residual, _ = robot.functions["ik"].ufunc(*inputs)
    regular = regular_slots(robot, inverse_of(robot), exact, residual.copy())
    far = apart(q[:, :, None], exact[:, None]).max(axis=3)
    nearest = np.where(valid[:, :, None], far, np.inf).min(axis=1)
    T = np.broadcast_to(inputs[0][:, None], (*valid.shape, 4, 4))[valid]
    wrong = np.abs(robot.fk(q[valid]) - T).max(axis=(1, 2)) > POSE_ERROR
    missing = (nearest > POSE_ERROR)[regular].sum()
    return int(missing + wrong.sum() + (~valid.any(axis=1)).sum())
