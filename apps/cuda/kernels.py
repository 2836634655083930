"""Launches the exported kernels of a robot on arrays in the memory of a GPU."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

from chasles import InputValueError, Robot, ShapeError
from chasles.autodiff.exported import exported
from chasles.contract import check_type, requires

from . import arrays

if TYPE_CHECKING:
    from .compiled import Source


class Kernels:
    """The exported CUDA kernels of a robot. NVRTC compiles a kernel at its first call.

    Arrays of CuPy, PyTorch or JAX must be C-contiguous, of float32 or float64, and in the memory of
    one GPU. Arrays are not copied. The last dimension of an array is the batch: q (n, count), T (4,
    4, count). Each result is a new array from the package of the arguments (CuPy, PyTorch or JAX).
    A kernel runs on the current stream of CuPy or PyTorch. A call on JAX arrays waits for the
    kernel. Calls on JAX arrays do not work inside `jax.jit`.

    Attributes:
        robot: The robot.
    """

    def __init__(self, robot: Robot, folder: str | os.PathLike[str]) -> None:
        """Read the exported source.

        Args:
            robot: The robot.
            folder: The folder that `chasles export cuda` wrote for this robot.

        Raises:
            NotInstalledError: cuda-bindings or NVRTC is not installed.
            InputValueError: The folder does not contain the CUDA source of this robot.
        """
        check_type("Kernels: robot", robot, Robot)
        with requires("chasles[cuda]"):
            from . import compiled  # noqa: PLC0415
        self.robot = robot
        source = compiled.read(exported(robot, folder, ".cuh", "cuda"))
        self._entry: Callable[[str, str, int], Any] = cache(
            lambda name, real, device: _entry(source, robot.name, name, real, device)
        )

    def __call__(self, name: str, *inputs: Any) -> Any:
        """Return the result of a function, or a tuple of several results.

        Args:
            name: The name of the function, such as "fk", "fk_jacobian_mixed" or "ik".
            inputs: One array for each input of the function, with the shape of the input and the
                batch size as last dimension.

        Raises:
            InputValueError: The export does not contain the function, or an array is unsuitable.
            ShapeError: An input array has the wrong shape.
        """
        info = self.robot.functions.get(name)
        if info is None or len(inputs) != len(info.inputs):
            raise InputValueError(f"{self.robot.name} has no function {name!r} with these inputs")
        shapes = [tuple(item.shape) for item in info.inputs]
        results = [tuple(item.shape) for item in info.outputs]
        found = self._launch(name, inputs, shapes, results)
        return found if len(found) > 1 else found[0]

    def ik_nearest(
        self, T: Any, q_seed: Any, *, lower: Any = None, upper: Any = None, weights: Any = None
    ) -> tuple[Any, Any, Any, Any]:
        """Return the solution of `ik` within limits that is nearest to a seed.

        Args:
            T: (4, 4, count) poses.
            q_seed: (n, count) seed coordinates [rad or m].
            lower: (n,) lower limits that apply to all poses, or None for the limits of the robot.
            upper: (n,) upper limits.
            weights: (n,) weights of the displacements, or None for 1.

        Returns:
            q (n, count), residual (count,), margin (count,) and slot (count,) as int32. A negative
            slot means that there is no solution. The slot is -1 if the pose is out of reach, -2 if
            the solutions are outside the limits, and -3 if T or q_seed is NaN.
        """
        n = self.robot.n
        shapes, results = [(4, 4), (n,)], [(n,), (), ()]
        q, residual, margin, slot = self._launch(
            "ik_nearest", [T, q_seed], shapes, results, [lower, upper, weights]
        )
        return q, residual, margin, slot

    def _launch(
        self,
        name: str,
        inputs: Sequence[Any],
        shapes: Sequence[tuple[int, ...]],
        results: Sequence[tuple[int, ...]],
        tables: Sequence[Any] = (),
    ) -> list[Any]:
        """Launch a kernel, and return its results.

        Args:
            name: The name of the function.
            inputs: Arrays with a column for each pose.
            shapes: The shapes of the inputs without the batch dimension.
            results: The shapes of the results without the batch dimension.
            tables: Arrays (n,) that all poses share, or None for an omitted array. If `tables` is
                not empty, the last array in the result contains the solution slot of each pose.
        """
        from . import compiled  # noqa: PLC0415

        views = [arrays.view(array) for array in inputs]
        shared = [None if array is None else arrays.view(array) for array in tables]
        count = views[0].shape[-1] if views[0].shape else 0
        needed = [(*shape, count) for shape in shapes]
        given = [table for table in shared if table is not None]
        for view, shape in zip(
            [*views, *given], needed + [(self.robot.n,)] * len(given), strict=True
        ):
            if view.shape != shape:
                raise ShapeError(f"{name}: an array must have shape {shape}, got {view.shape}")
            if not view.real or view.real != views[0].real:
                raise InputValueError(f"{name}: arrays must all be float32 or all float64")
        made = [arrays.empty((*shape, count), inputs[0]) for shape in results]
        made += [arrays.empty((count,), inputs[0], is_integer=True)] if tables else []
        if count:
            addresses = [view.address for view in views]
            addresses += [0 if table is None else table.address for table in shared]
            addresses += [arrays.view(array).address for array in made]
            device = compiled.device_of(addresses[0])
            entry = self._entry(name, views[0].real, device)
            compiled.launch(entry, device, count, addresses, arrays.stream(inputs[0]))
            if arrays.is_jax(inputs[0]):
                compiled.synchronize(device)
        return made


def _entry(source: Source, robot: str, name: str, real: str, device: int) -> Any:
    """Return a compiled kernel on a device."""
    from . import compiled  # noqa: PLC0415

    image, entry = compiled.compiled(source, robot, name, real, compiled.architecture(device))
    return compiled.loaded(image, entry, device)
