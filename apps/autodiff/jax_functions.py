"""Functions of a robot in JAX, through the foreign function interface of XLA."""

from __future__ import annotations

import ctypes
import os
import shlex
import subprocess
from collections.abc import Callable, Sequence
from functools import cache
from hashlib import sha256
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

import chasles
from chasles import ChaslesError, InputValueError, Robot
from chasles.contract import temporary_folder

from .differentiable_arm import DifferentiableArm, Solutions, fixed_coordinates
from .exported import exported
from .tolerances import MAX_INVERSE, SOLVED

_SOURCE = Path(__file__).with_name("_rows.cpp")
_KERNEL = Path(chasles.__file__).parent / "library"
_FLAGS = ("-std=c++17", "-O2", "-fPIC", "-shared")
_TARGET = "chasles_rows"


def arm(robot: Robot, folder: str | os.PathLike[str] | None) -> DifferentiableArm:
    """Return the functions of a robot for JAX."""
    _register()
    names = ("hessian_mixed", "jacobian_mixed", "fk", "ik")
    module = None if folder is None else _module(exported(robot, folder, "_jax.py", "jax"), names)
    raw = {name: _raw(robot, name, getattr(module, name, None)) for name in names}
    jacobian = _jacobian(raw["jacobian_mixed"], raw["hessian_mixed"])
    fk, ik = _fk(raw["fk"], jacobian), _ik(robot, raw["ik"], jacobian)
    return DifferentiableArm(robot, fk, jacobian, raw["hessian_mixed"], ik)


def _module(path: Path, names: Sequence[str]) -> ModuleType:
    """Return the exported module of a robot.

    Raises:
        InputValueError: The module lacks a function.
    """
    spec = spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    missing = [name for name in names if not hasattr(module, name)]
    if missing:
        raise InputValueError(f"module {path} has no function {', '.join(missing)}")
    return module


@cache
def _register() -> None:
    """Compile and register the library for this version of JAX."""
    library = ctypes.CDLL(str(_library()))
    function = jax.ffi.pycapsule(getattr(library, _TARGET))
    jax.ffi.register_ffi_target(_TARGET, function, platform="cpu")


def _library() -> Path:
    parts = (_SOURCE.read_text(encoding="utf-8"), jax.__version__, *_FLAGS)
    path = _cache() / f"jax-{sha256(repr(parts).encode()).hexdigest()[:32]}.so"
    if path.exists():
        return path
    path.parent.mkdir(parents=True, exist_ok=True)
    command = [*shlex.split(os.environ.get("CXX", "c++")), *_FLAGS, str(_SOURCE)]
    command += ["-isystem", jax.ffi.include_dir(), "-I", str(_KERNEL)]
    with temporary_folder(path.parent, "jax") as folder:
        target = folder / path.name
        try:
            subprocess.run([*command, "-o", str(target)], check=True, capture_output=True)
        except (OSError, subprocess.CalledProcessError) as error:
            output = getattr(error, "stderr", b"") or b""
            text = output.decode(errors="replace")
            raise ChaslesError(
                f"JAX requires a C++17 compiler (CXX or c++): {error}\n{text}"
            ) from error
        target.replace(path)
    return path


def _cache() -> Path:
    chosen, xdg = os.environ.get("CHASLES_CACHE"), os.environ.get("XDG_CACHE_HOME", "")
    if chosen:
        return Path(chosen).absolute()
    return (Path(xdg) if os.path.isabs(xdg) else Path.home() / ".cache") / "chasles"


def _raw(robot: Robot, name: str, printed: Callable[..., Any] | None) -> Callable[..., Any]:
    """Return a robot function for JAX, without derivative rules.

    Args:
        robot: The robot.
        name: The name of the function.
        printed: The function for devices other than the CPU, or None.
    """
    function = robot.functions[name]  # the reference in `call` keeps the kernel loaded
    address = _address(function.kernel)

    def call(*inputs: Any) -> Any:
        arrays = [jnp.asarray(item) for item in inputs]
        kind = jnp.result_type(float, *arrays)
        shapes = [item.shape for item in function.inputs]
        leading = [a.shape[: a.ndim - len(s)] for a, s in zip(arrays, shapes, strict=True)]
        batch = jnp.broadcast_shapes(*leading)
        rows = [
            jnp.broadcast_to(array.astype(kind), (*batch, *shape))
            for array, shape in zip(arrays, shapes, strict=True)
        ]
        results = [jax.ShapeDtypeStruct((*batch, *item.shape), kind) for item in function.outputs]

        def compiled(*rows: Any) -> Any:
            target = jax.ffi.ffi_call(_TARGET, results, vmap_method="broadcast_all")
            values = target(*rows, kernel=address)
            return tuple(values) if len(results) > 1 else values[0]

        if printed is None:
            return compiled(*rows)
        return jax.lax.platform_dependent(*rows, cpu=compiled, default=printed)

    return call


def _address(capsule: object) -> np.int64:
    pointer = ctypes.pythonapi.PyCapsule_GetPointer
    pointer.restype, pointer.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    return np.int64(pointer(capsule, b"chasles.kernel"))


def _jacobian(raw: Callable[..., Any], hessian: Callable[..., Any]) -> Callable[..., Any]:
    jacobian = jax.custom_jvp(raw)

    @jacobian.defjvp
    def _(primals: tuple[Any], tangents: tuple[Any]) -> tuple[Any, Any]:
        (q,), (q_dot,) = primals, tangents
        return jacobian(q), jnp.einsum("...ijk,...k->...ij", hessian(q), q_dot)

    return jacobian


def _fk(raw: Callable[..., Any], jacobian: Callable[..., Any]) -> Callable[..., Any]:
    fk = jax.custom_jvp(raw)

    @fk.defjvp
    def _(primals: tuple[Any], tangents: tuple[Any]) -> tuple[Any, Any]:
        (q,), (q_dot,) = primals, tangents
        T = fk(q)
        V = jnp.einsum("...ij,...j->...i", jacobian(q), q_dot)
        R_dot = _skew(V[..., 3:]) @ T[..., :3, :3]
        top = jnp.concatenate([R_dot, V[..., :3, None]], axis=-1)
        return T, jnp.concatenate([top, jnp.zeros_like(top[..., :1, :])], axis=-2)

    return fk


def _ik(
    robot: Robot, raw: Callable[..., Any], jacobian: Callable[..., Any]
) -> Callable[..., Solutions]:
    fixed = fixed_coordinates(robot)
    free = [k for k in range(robot.n) if k not in fixed]
    order = jnp.argsort(jnp.array([*free, *fixed]))

    @jax.custom_jvp
    def solve(*inputs: Any) -> Solutions:
        return Solutions(*raw(*inputs))

    @solve.defjvp
    def _(primals: tuple[Any, ...], tangents: tuple[Any, ...]) -> tuple[Solutions, Solutions]:
        found = solve(*primals)
        (T, *_), (T_dot, *fixed_dot) = primals, tangents
        W = T_dot[..., :3, :3] @ jnp.swapaxes(T[..., :3, :3], -1, -2)
        omega = [W[..., i, j] - W[..., j, i] for i, j in ((2, 1), (0, 2), (1, 0))]
        V = jnp.concatenate([T_dot[..., :3, 3], 0.5 * jnp.stack(omega, axis=-1)], axis=-1)
        solved = found.residual <= SOLVED[str(found.q.dtype)]
        J = jacobian(jnp.where(solved[..., None], found.q, 0))
        V = jnp.broadcast_to(V[..., None, :], J.shape[:-1])
        for k, rate in zip(fixed, fixed_dot, strict=True):
            V = V - J[..., k] * rate[..., None, None]
        # If a solution slot contains no solution, its inverse Jacobian is set to 0. A NaN would
        # spread to the gradient, because NaN times 0 is NaN.
        inverse = jnp.where(solved[..., None, None], _inverse(J[..., jnp.array(free)]), 0)
        rates = jnp.einsum("...ij,...j->...i", inverse, V)
        own = [(rate[..., None] * solved)[..., None] for rate in fixed_dot]
        q_dot = jnp.concatenate([rates, *own], axis=-1)[..., order]
        zeros = jnp.zeros_like(found.residual)
        return found, Solutions(q_dot, zeros, zeros)

    return solve


def _inverse(J: Any) -> Any:
    """Return the (pseudo)inverse, or NaN for a singular matrix."""
    transposed = jnp.swapaxes(J, -1, -2)
    if J.shape[-2] == J.shape[-1]:
        inverse = jnp.linalg.inv(J)
    else:
        inverse = jnp.linalg.inv(transposed @ J) @ transposed
    largest = jnp.max(jnp.abs(inverse), axis=(-2, -1), keepdims=True)
    return jnp.where(largest < MAX_INVERSE[str(J.dtype)], inverse, jnp.nan)


def _skew(omega: Any) -> Any:
    x, y, z = omega[..., 0], omega[..., 1], omega[..., 2]
    zero = jnp.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return jnp.stack([jnp.stack(row, axis=-1) for row in rows], axis=-2)
