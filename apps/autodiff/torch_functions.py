"""Functions of a robot in PyTorch, as custom operators with autograd."""

from __future__ import annotations

from functools import partial
from typing import Any

import torch
from torch import Tensor
from torch.library import custom_op, register_autograd

from chasles import Robot

from .differentiable_arm import DifferentiableArm, Solutions, fixed_coordinates
from .tolerances import MAX_INVERSE, SOLVED

_ROBOTS: dict[str, Robot] = {}
"""Robots keyed by a string, because PyTorch operators accept only strings and tensors."""


def arm(robot: Robot) -> DifferentiableArm:
    """Return the functions of a robot for PyTorch."""
    key = f"{robot.name} {robot.digest}"
    _ROBOTS[key] = robot
    fixed = list(fixed_coordinates(robot))

    def ik(T: Tensor, *values: Tensor) -> Solutions:
        batch = torch.broadcast_shapes(T.shape[:-2], *(value.shape for value in values))
        joints = [value.to(T.dtype).expand(batch) for value in values]
        given = torch.stack(joints, dim=-1) if joints else T.new_empty((*batch, 0))
        return Solutions(*_ik(T.expand(*batch, 4, 4), given, key, fixed))

    fk, jacobian, hessian = (partial(function, key=key) for function in (_fk, _jacobian, _hessian))
    return DifferentiableArm(robot, fk, jacobian, hessian, ik)


def _evaluated(key: str, name: str, *inputs: Tensor) -> tuple[Tensor, ...]:
    """Evaluate a function without copying float64 inputs."""
    ufunc = _ROBOTS[key].functions[name].ufunc
    # NumPy allocates large arrays in huge pages. An allocation by NumPy is four times as fast as an
    # allocation by PyTorch.
    found = ufunc(*(item.detach().to(torch.float64).numpy() for item in inputs))
    results = found if isinstance(found, tuple) else (found,)
    return tuple(torch.from_numpy(item).to(inputs[0].dtype) for item in results)


@custom_op("chasles::fk", mutates_args=())
def _fk(q: Tensor, key: str) -> Tensor:
    return _evaluated(key, "fk", q)[0]


@custom_op("chasles::jacobian", mutates_args=())
def _jacobian(q: Tensor, key: str) -> Tensor:
    return _evaluated(key, "jacobian_mixed", q)[0]


@custom_op("chasles::hessian", mutates_args=())
def _hessian(q: Tensor, key: str) -> Tensor:
    return _evaluated(key, "hessian_mixed", q)[0]


@custom_op("chasles::ik", mutates_args=())
def _ik(T: Tensor, given: Tensor, key: str, fixed: list[int]) -> tuple[Tensor, Tensor, Tensor]:
    q, residual, margin = _evaluated(key, "ik", T, *(given[..., k] for k in range(len(fixed))))
    return q, residual, margin


@_fk.register_fake
def _(q: Tensor, key: str) -> Tensor:  # noqa: ARG001
    return q.new_empty((*q.shape[:-1], 4, 4))


@_jacobian.register_fake
def _(q: Tensor, key: str) -> Tensor:  # noqa: ARG001
    return q.new_empty((*q.shape[:-1], 6, q.shape[-1]))


@_hessian.register_fake
def _(q: Tensor, key: str) -> Tensor:  # noqa: ARG001
    return q.new_empty((*q.shape[:-1], 6, q.shape[-1], q.shape[-1]))


@_ik.register_fake
def _(
    T: Tensor,
    given: Tensor,  # noqa: ARG001
    key: str,
    fixed: list[int],  # noqa: ARG001
) -> tuple[Tensor, Tensor, Tensor]:
    slots, n = _ROBOTS[key].functions["ik"].outputs[0].shape
    batch = T.shape[:-2]
    return (
        T.new_empty((*batch, slots, n)),
        T.new_empty((*batch, slots)),
        T.new_empty((*batch, slots)),
    )


def _keep(ctx: Any, inputs: tuple[Any, ...], output: Any) -> None:
    tensors = [item for item in inputs if isinstance(item, Tensor)]
    results = output if isinstance(output, tuple) else (output,)
    ctx.save_for_backward(*tensors, *results)
    ctx.constants = [item for item in inputs if not isinstance(item, Tensor)]


def _fk_backward(ctx: Any, of_T: Tensor) -> tuple[Tensor, None]:
    q, T = ctx.saved_tensors
    (key,) = ctx.constants
    turning = _axial(of_T[..., :3, :3] @ T[..., :3, :3].mT)
    of_V = torch.cat([of_T[..., :3, 3], turning], dim=-1)
    return torch.einsum("...ij,...i->...j", _jacobian(q, key), of_V), None


def _jacobian_backward(ctx: Any, of_J: Tensor) -> tuple[Tensor, None]:
    q, _ = ctx.saved_tensors
    (key,) = ctx.constants
    return torch.einsum("...ijk,...ij->...k", _hessian(q, key), of_J), None


def _ik_backward(
    ctx: Any, of_q: Tensor, _residual: Tensor, _margin: Tensor
) -> tuple[Tensor, Tensor, None, None]:
    T, _, q, residual, _ = ctx.saved_tensors
    key, fixed = ctx.constants
    free = [k for k in range(q.shape[-1]) if k not in fixed]
    solved = (residual <= SOLVED[_kind(q)])[..., None]
    J = _jacobian(torch.where(solved, q, 0), key)
    of_q = torch.where(solved, of_q, 0)
    of_V = torch.einsum("...ij,...i->...j", _inverse(J[..., free]), of_q[..., free])
    of_V = torch.where(solved, of_V, 0)
    of_fixed = of_q[..., fixed] - torch.einsum("...ij,...i->...j", J[..., fixed], of_V)
    total = of_V.sum(dim=-2)
    of_R = 0.5 * _skew(total[..., 3:]) @ T[..., :3, :3]
    top = torch.cat([of_R, total[..., :3, None]], dim=-1)
    of_T = torch.cat([top, torch.zeros_like(top[..., :1, :])], dim=-2)
    return of_T, of_fixed.sum(dim=-2), None, None


def _kind(values: Tensor) -> str:
    return str(values.dtype).removeprefix("torch.")


def _inverse(J: Tensor) -> Tensor:
    """Return the (pseudo)inverse, or NaN for a singular matrix."""
    if J.shape[-2] == J.shape[-1]:
        inverse, info = torch.linalg.inv_ex(J)
    else:
        inverse, info = torch.linalg.inv_ex(J.mT @ J)
        inverse = inverse @ J.mT
    is_regular = (info == 0) & (inverse.abs().amax(dim=(-2, -1)) < MAX_INVERSE[_kind(J)])
    return torch.where(is_regular[..., None, None], inverse, torch.nan)


def _axial(A: Tensor) -> Tensor:
    """Return the vector a with dot(a, w) = trace(A^T [w]x) for all vectors w."""
    pairs = ((2, 1), (0, 2), (1, 0))
    return torch.stack([A[..., i, j] - A[..., j, i] for i, j in pairs], dim=-1)


def _skew(omega: Tensor) -> Tensor:
    x, y, z = omega.unbind(dim=-1)
    zero = torch.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return torch.stack([torch.stack(row, dim=-1) for row in rows], dim=-2)


register_autograd("chasles::fk", _fk_backward, setup_context=_keep)
register_autograd("chasles::jacobian", _jacobian_backward, setup_context=_keep)
register_autograd("chasles::ik", _ik_backward, setup_context=_keep)
