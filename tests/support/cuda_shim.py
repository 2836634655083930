"""Kernels of CUDA that a C++ compiler compiles for the processor, and their calls."""

import ctypes
import subprocess
from pathlib import Path

import numpy as np

import chasles
from chasles.derive import write
from chasles.derive.emit.cpp.header import safe
from tests.support.derivations import robot_of

FUNCTIONS = ["fk", "fk_jacobian_mixed", "jacobian_mixed", "ik", "chain"]
FLAGS = ["-std=c++17", "-O1", "-ffp-contract=off", "-shared", "-fPIC"]
WARNINGS = ["-Wall", "-Wextra", "-Werror", "-Wno-unknown-pragmas"]
SHIM = Path(__file__).parent / "native" / "cuda_shim.h"
KINDS = {"float": np.float32, "double": np.float64}


class Shim:
    """The exported kernels of a robot.

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
        """Returns the results of a kernel for rows of inputs."""
        info = self.functions[name]
        shapes = [tuple(item.shape) for item in info.outputs]
        return self._called(f"{name}_{kind}", KINDS[kind], inputs, shapes)

    def nearest(self, kind, T, q_seed, *, lower=None, upper=None, weights=None):
        """Returns the results of the kernel ``ik_nearest``: q, residual, margin and slot."""
        own = [None if x is None else np.asarray(x)[None] for x in (lower, upper, weights)]
        shapes = [(self.robot.n,), (), (), ()]
        found = self._called(f"ik_nearest_{kind}", KINDS[kind], [T, q_seed, *own], shapes)
        return *found[:3], found[3].view(np.int32)[: len(T)]

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
        """Returns a C function for each kernel and kind of number."""
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
    """Returns an array with the entries of each row in a column."""
    return np.ascontiguousarray(rows.reshape(len(rows), -1).T)
