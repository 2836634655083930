"""Compiles CUDA kernels for the processor, and compares their results with the compiled C."""

import ctypes
import re
import subprocess
from pathlib import Path

import numpy as np

import chasles
from chasles.derive import write
from chasles.derive.emit.reserved import safe
from tests.support.derivations import robot_of
from tests.support.exports import apart, expected, inputs_of, inverse_of, regular_slots

FUNCTIONS = ["fk", "fk_jacobian_mixed", "jacobian_mixed", "ik", "chain"]
FLAGS = ["-std=c++17", "-O1", "-ffp-contract=off", "-shared", "-fPIC"]
WARNINGS = ["-Wall", "-Wextra", "-Werror", "-Wno-unknown-pragmas"]
SHIM = Path(__file__).parent / "native" / "cuda_shim.h"
KINDS = {"float": np.float32, "double": np.float64}
SOLVED = {"float": 2e-5, "double": 1e-9}
"""Maximum residual of an inverse kinematics solution, for each floating-point type."""
TOLERANCE = {"float": 1e-4, "double": 1e-12}
"""Maximum difference between results of the CUDA kernels and of the C code, for each floating-point
type."""


class Shim:
    """The exported CUDA kernels of a robot, compiled for the processor.

    Attributes:
        robot: The robot.
        folder: The folder of the exported files.
    """

    def __init__(self, name, folder):
        self.robot, self.folder = chasles.load(name), folder
        self.functions = {f.name: f for f in self.robot.manifest.functions if f.name in FUNCTIONS}
        write(robot_of(name), folder, functions=[*self.functions], languages=["cuda"])
        (folder / "calls.cpp").write_text(self._source())
        own = ["-include", SHIM, "-I", folder, "calls.cpp", "-o", "kernels.so"]
        command = ["g++", *FLAGS, *WARNINGS, *own]
        done = subprocess.run(command, cwd=folder, capture_output=True, check=False)
        assert done.returncode == 0, done.stderr.decode()
        self.library = ctypes.CDLL(str(folder / "kernels.so"))

    def __call__(self, name, kind, inputs):
        info = self.functions[name]
        shapes = [tuple(item.shape) for item in info.outputs]
        return self._called(f"{name}_{kind}", KINDS[kind], inputs, shapes)

    def nearest(self, kind, T, q_seed, *, lower=None, upper=None, weights=None):
        """Return q, residual, margin and solution slot from the kernel ``ik_nearest``."""
        own = [None if x is None else np.asarray(x)[None] for x in (lower, upper, weights)]
        shapes = [(self.robot.n,), (), (), ()]
        found = self._called(f"ik_nearest_{kind}", KINDS[kind], [T, q_seed, *own], shapes)
        return *found[:3], found[3].view(np.int32)[: len(T)]

    def bounds(self, kind, name):
        """Return the error bounds of a function's results."""
        text = (self.folder / f"{self.robot.name}.cuh").read_text()
        comment = text.split(f"void {name}(")[0].rsplit("/*", 1)[1]
        printed = [float(bound) for bound in re.findall(r", error (\S+)$", comment, re.MULTILINE)]
        return printed if kind == "float" else [TOLERANCE[kind]] * len(printed)

    def _called(self, name, kind, inputs, shapes):
        count = len(inputs[0])
        arrays = [None if x is None else columns(np.asarray(x, kind)) for x in inputs]
        results = [np.full((int(np.prod(shape)), count), np.nan, kind) for shape in shapes]
        addresses = [None if x is None else x.ctypes.data for x in (*arrays, *results)]
        pointers = (ctypes.c_void_p * len(addresses))(*addresses)
        self.library[name](ctypes.c_size_t(count), pointers)
        pairs = zip(results, shapes, strict=True)
        return [np.ascontiguousarray(x.T).reshape(count, *shape) for x, shape in pairs]

    def _source(self):
        space, counts = safe(self.robot.name), {"ik_nearest": 9}
        for name, info in self.functions.items():
            counts[name] = len(info.inputs) + len(info.outputs)
        lines = [f'#include "{self.robot.name}.cuh"', f"namespace robot = chasles::{space};"]
        for name, count in counts.items():
            passed = ", ".join(f"at[{k}]" for k in range(count))
            for kind in KINDS:
                head = f'extern "C" void {name}_{kind}(size_t poses, void *const *at)'
                call = f"launch(robot::{name}_kernel<{kind}>, poses, {passed})"
                lines.append(f"{head} {{ {call}; }}")
        return "\n".join([*lines, ""])


def columns(rows):
    return np.ascontiguousarray(rows.reshape(len(rows), -1).T)


def differing(shim, kind, q):
    """List the CUDA functions whose results differ from the results of the C code.

    Inverse kinematics solutions are compared only away from singularities.
    """
    lines = []
    for name, info in shim.functions.items():
        inputs = inputs_of(shim.robot, info, q)
        found, exact = shim(name, kind, inputs), expected(shim.robot, info, inputs)
        kept = slice(None)
        if info.role.is_inverse:
            kept = regular_slots(shim.robot, info, *exact[:2])
            if missed := int((found[1][kept] > SOLVED[kind]).sum()):
                lines.append(f"{shim.robot.name}, {name}, {kind}: {missed} solutions missed")
        for x, y, bound in zip(found, exact, shim.bounds(kind, name), strict=True):
            worst = apart(x, y)[kept].max()
            if not worst <= bound:
                lines.append(f"{shim.robot.name}, {name}, {kind}: differs by {worst:.1e}")
    return lines


def incomplete(shim, kind, q):
    """List the differences between the IK solutions of the CUDA kernel and of the C code."""
    robot, info, lines = shim.robot, inverse_of(shim.robot), []
    inputs = inputs_of(robot, info, q)
    exact = expected(robot, info, inputs)
    found, residual, _ = shim("ik", kind, inputs)
    solved, regular = exact[1] <= SOLVED["double"], regular_slots(robot, info, *exact[:2])
    if count := int(((residual <= SOLVED[kind]) != solved).sum()):
        lines.append(f"{robot.name}, {kind}: {count} slots are solved only here or only in C")
    T = np.broadcast_to(inputs[0][:, None], (*solved.shape, 4, 4))[solved]
    largest = np.abs(robot.fk(found[solved].astype(float)) - T).max()
    if not largest <= SOLVED[kind]:
        lines.append(f"{robot.name}, {kind}: a solution misses its pose by {largest:.1e}")
    worst = apart(found, exact[0]).max(axis=-1)[regular].max()
    if not worst <= TOLERANCE[kind]:
        lines.append(f"{robot.name}, {kind}: a solution differs by {worst:.1e}")
    return lines
