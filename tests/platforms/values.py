"""Values of every shipped robot, computed on this machine and compared on another platform.

`python values.py write FILE` writes the values. The script needs only chasles and NumPy.
"""

import hashlib
import os
import shutil
import sys
import tempfile
import time
from functools import partial
from pathlib import Path

import numpy as np

import chasles
from chasles.contract.isolation import IsolatedWorkError, Limits, isolated
from chasles.library import cache_folder

N = 64
"""Number of random configurations for each robot."""
N_LARGE = 400_000
"""Number of poses of a batch. Its Jacobians are so large that `release_memory` can return their
memory to the operating system."""
SAME = 1e-12
"""Tolerance of functions relative to the largest entry, because compilers and mathematical
libraries round differently."""
SAME_SOLUTION = 1e-7
"""Tolerance of solutions [rad or m]; near double roots, rounding is amplified."""
FUNCTIONS = {
    *("fk", "link_poses", "fk_jacobian_mixed", "hessian_mixed", "chain"),
    *("jacobian_space", "jacobian_body", "jacobian_mixed"),
}
"""Functions of the configuration that are compared for every robot that has them."""


def fixed_at(robot, q):
    """Return the values of the redundancy parameters at the configurations q."""
    joints = [joint.name for joint in robot.chain_joints]
    values = {}
    for item in robot.redundancy:
        if item.name in robot.functions:
            values[item.name] = robot.functions[item.name](q)
        elif robot.loops:
            values[item.name] = robot.chain(q)[..., joints.index(item.name)]
        else:
            values[item.name] = q[..., item.index]
    return {"fixed": values} if values else {}


def values_of(robot, q):
    """Return the results of all functions at the configurations q, keyed by function name."""
    found = {}
    for name in sorted(FUNCTIONS & set(robot.functions)):
        outputs = robot.functions[name](q)
        for k, value in enumerate(outputs if isinstance(outputs, tuple) else (outputs,)):
            found[f"{name}.{k}"] = value
    T = robot.fk(q)
    np.testing.assert_array_equal(robot.fk(np.tile(q, (500, 1)), threads=2)[: len(q)], T)
    if "ik" in robot.functions:
        solutions = robot.ik(T, **fixed_at(robot, q))
        found["ik.valid"] = solutions.valid
        found["ik.q"] = np.where(solutions.valid[..., None], solutions.q, 0)
        found["ik_nearest.q"] = robot.ik_nearest(T, q).q
    seed = np.clip(q + 0.01, robot.lower, robot.upper)
    one, two = (robot.ik_numeric(T, seed, threads=threads) for threads in (1, 2))
    np.testing.assert_array_equal(one.q, two.q)
    found["ik_numeric.valid"] = one.valid
    return found


def write(file):
    """Write the values of all robots."""
    values = {}
    for name in chasles.robots():
        robot = chasles.load(name)
        q = values[f"{name}/q"] = robot.random_q(N)
        values.update({f"{name}/{key}": value for key, value in values_of(robot, q).items()})
    np.savez(file, **values)


def difference(key, found, expected):
    """Return the largest difference between two arrays, divided by the tolerance."""
    if found.shape != expected.shape or not np.array_equal(np.isnan(found), np.isnan(expected)):
        return np.inf
    if found.dtype == bool:
        return np.inf if (found != expected).any() else 0.0
    scale = SAME_SOLUTION if key.startswith("ik") else SAME * np.nanmax(np.abs(expected), initial=1)
    return np.nanmax(np.abs(found - expected), initial=0) / scale


def compare(file):
    """Compare all robots with a file of values. Returns the number of differing values."""
    values, failed = np.load(file), 0
    for name in chasles.robots():
        robot = chasles.load(name)
        found = values_of(robot, values[f"{name}/q"])
        found = {key: difference(key, found[key], values[f"{name}/{key}"]) for key in found}
        wrong = {key: value for key, value in found.items() if value > 1}
        failed += len(wrong)
        print(f"{name:<20} {len(found):3d} values, worst {max(found.values()):.2g}", wrong or "")
    return failed


def check_memory():
    arm = chasles.load("ur5e")
    q = np.zeros((N_LARGE, 6))
    for _ in range(3):
        J = arm.jacobian_mixed(q)
    del J
    assert chasles.release_memory() > 0


def check_folders(folder, kernels):
    """A path may contain slashes and Greek letters. A folder with a damaged kernel is rejected."""
    moved, broken = (folder / "Größe \u03a9" / name for name in ("scara", "broken"))
    for copy in (moved, broken):
        # Wine 8 has no CopyFile2, which shutil.copy2 calls.
        shutil.copytree(Path(kernels) / "scara", copy, copy_function=shutil.copyfile)
    os.chdir(folder)
    np.testing.assert_array_equal(
        chasles.load("./Größe \u03a9/scara").fk([0.1] * 4), chasles.load("scara").fk([0.1] * 4)
    )
    (kernel,) = broken.glob("*.so")
    text = b"not a library"
    kernel.write_bytes(text + hashlib.sha256(text).digest())
    message = "loaded"
    try:
        chasles.load(broken)
    except chasles.MismatchError as error:
        message = str(error)
    assert "cannot be opened as a library (" in message, message


def check_system():
    """Check that the cache is in the user's folder and that separate processes have time limits."""
    assert cache_folder() == Path(os.environ["LOCALAPPDATA"]) / "chasles"
    assert isolated(partial(sum, [1, 2])) == 3
    try:
        isolated(partial(time.sleep, 60), Limits(seconds=0.1))
    except IsolatedWorkError as error:
        message = str(error)
    assert message == "it takes longer than 0.1 s"


def main(action, file, *kernels):
    check_memory()
    if action == "write":
        write(file)
        return 0
    if os.name == "nt":
        check_system()
    # Windows does not remove a library that a process has loaded.
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        check_folders(Path(folder), *kernels)
        os.chdir(Path(folder).parent)
    return compare(file)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], *map(os.path.abspath, sys.argv[2:])))
