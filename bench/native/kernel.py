"""C loop that calls a generated C function for each row of an array of inputs."""

import ctypes
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import chasles
from tests.support.native import UNPACKED, Source, compiled

from .library import aligned

MAIN = """
#include "{robot}.c"
__attribute__((visibility("default")))
void run(const double *in, long size, long count, double *out)
{{
    for (long k = 0; k < count; k++, in += size) {{
        {robot}_{function}({arguments});
        __asm__ volatile("" : : "r"(out) : "memory");
    }}
}}
"""
"""The empty assembly statement makes the compiler assume that the results are read."""
ROOM = 512
"""Maximum number of doubles in a result. The doubles fill a whole number of cache lines."""


@dataclass(frozen=True)
class Kernel:
    """A compiled function that is called for each row of an input array.

    Attributes:
        library: The loaded library.
        size: Number of scalar inputs per call, which is the length of a row of the input array.
        results: The results of the last call, one row per output.
        shapes: The shape of each output.
    """

    library: ctypes.CDLL
    size: int
    results: np.ndarray
    shapes: tuple[tuple[int, ...], ...]

    def at(self, row: np.ndarray) -> list[np.ndarray]:
        """Return the results for one row of inputs."""
        self.run(np.ascontiguousarray(row).reshape(1, self.size))
        sized = zip(self.results, self.shapes, strict=True)
        return [values[: math.prod(shape)].reshape(shape).copy() for values, shape in sized]

    def run(self, rows: np.ndarray) -> None:
        """Call the function once for each row of a C-contiguous (m, size) array."""
        assert rows.shape[1:] == (self.size,)
        assert rows.flags.c_contiguous
        sizes = ctypes.c_long(self.size), ctypes.c_long(len(rows))
        first, results = (ctypes.c_void_p(array.ctypes.data) for array in (rows, self.results))
        self.library.run(first, *sizes, results)


def kernel(robot: chasles.Robot, function: str, flags: Sequence[str] = ()) -> Kernel:
    """Compile a robot function with the flags of chasles.

    An input row contains all arguments of a function.
    """
    inputs, outputs = robot.functions[function].inputs, robot.functions[function].outputs
    sizes = [math.prod(array.shape) for array in inputs]
    arguments = [f"in + {sum(sizes[:k])}" for k in range(len(sizes))]
    arguments += [f"out + {ROOM * k}" for k in range(len(outputs))]
    main = MAIN.format(robot=robot.name, function=function, arguments=", ".join(arguments))
    own = robot.manifest.sources()
    files = {"main.c": main, **own}
    library = compiled(Source(f"{robot.name}-{function}", files, (UNPACKED, *flags)))
    results, shapes = aligned(len(outputs), ROOM), tuple(array.shape for array in outputs)
    return Kernel(ctypes.CDLL(str(library)), sum(sizes), results, shapes)
