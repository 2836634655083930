"""Actuator values at a pose, for robots without a closed-form forward solution."""

from functools import cache
from itertools import product

import numpy as np
import pytest

from chasles.derive import derive, read_text
from chasles.derive.terms.casadi_graph import lower
from tests.support.derivations import ROBOTS
from tests.support.loops.closures import Model

POSES, STARTS, CLOSED = 3, 6, 1e-12
HEXA = """
name = "hexa"
convention = "urdf"
actuated = [{arms}]
units = {{ length = "mm", angle = "deg" }}
tool = {{ body = "platform" }}
[[joints]]
name = "platform"
type = "free"
link = "platform"
{legs}
[reference]
z = 380
{reference}
"""
LEG = """
[[joints]]
name = "arm_{k}"
parent = "0"
link = "arm_{k}"
xyz = ["300*cos({base})", "300*sin({base})", 0]
rpy = [0, 0, {heading}]
axis = [0, -1, 0]
[[rods]]
name = "rod_{k}"
length = 420
ends = "ball"
a = {{ body = "arm_{k}", xyz = [120, 0, 0] }}
b = {{ body = "platform", xyz = ["150*cos({ball})", "150*sin({ball})", 0] }}
"""


TRIPOD = """
name = "tripod"
convention = "urdf"
actuated = ["leg_0", "leg_1", "leg_2"]
units = {{ length = "mm", angle = "deg" }}
tool = {{ body = "platform" }}
[[joints]]
name = "tilt_x"
link = "fork"
axis = [1, 0, 0]
[[joints]]
name = "tilt_y"
link = "sleeve"
axis = [0, 1, 0]
[[joints]]
name = "extend"
link = "platform"
type = "prismatic"
xyz = [0, 0, -900]
axis = [0, 0, -1]
{legs}
"""
PISTON = """
[[cylinders]]
name = "leg_{k}"
retracted = 950
ends = "ball"
a = {{ body = "0", xyz = ["{wide}*cos({at})", "{wide}*sin({at})", {up}] }}
b = {{ body = "platform", xyz = ["200*cos({at})", "200*sin({at})", 0] }}
"""


def tripod():
    """Return a tripod in which three irregularly placed cylinders tilt and extend a tube."""
    sizes = enumerate(((520, 0, 10), (480, 128, -20), (505, 236, 35)))
    return read_text(
        TRIPOD.format(
            legs="".join(PISTON.format(k=k, wide=w, at=a, up=u) for k, (w, a, u) in sizes)
        ),
        file="tripod.toml",
    )


def hexa():
    """Return a six-arm platform whose three pairs of arms are at intervals of 120 degrees."""
    legs = []
    for k in range(6):
        middle, side = 120 * (k // 2), 2 * (k % 2) - 1
        base = middle + 20 * side
        legs.append(LEG.format(k=k, base=base, heading=base + 15 * side, ball=middle + 40 * side))
    arms = [f"arm_{k}" for k in range(6)]
    quoted = ", ".join(f'"{arm}"' for arm in arms)
    at = "\n".join(f"{arm} = 20" for arm in arms)
    return read_text(HEXA.format(arms=quoted, legs="".join(legs), reference=at), file="hexa.toml")


def twisted_delta():
    """Return a delta robot with one rod of the second pair displaced at its platform end."""
    text = (ROBOTS / "delta.toml").read_text(encoding="utf-8")
    wide = text.replace("cos(120) - w*sin(120)", "cos(120) - w*sin(130)")
    return read_text(
        wide.replace("sin(120) + w*cos(120)", "sin(120) + w*cos(130)"), file="delta.toml"
    )


@cache
def solved(make):
    mechanism = make()
    ik = derive(mechanism, functions=["ik_legs"]).function("ik_legs")
    (kernel,) = lower([ik], "arms")

    def of(T):
        flat, slots = T.reshape(-1, 16).T, []
        for signs in product((1.0, -1.0), repeat=len(ik.signs)):
            choice = np.repeat(np.array(signs)[:, None], len(T), 1)
            slots.append([np.array(part) for part in kernel(flat, choice)[:2]])
        return np.stack([q.T for q, _ in slots]), np.stack([r[0] for _, r in slots])

    return of


@cache
def drawn(make):
    """Return random coordinates (n,) and platform poses (m, 4, 4) near the reference."""
    mechanism, rng = make(), np.random.default_rng(0)
    model, at = Model(mechanism), dict(mechanism.reference)
    reach = np.where([c.kind == "prismatic" for c in mechanism.coordinates], 0.1, 0.3)
    z = np.array([[float(at.get(name, 0)) for name in model.names]])
    q = z[0, model.actuated] + reach * rng.uniform(-1, 1, len(reach))
    z = z + rng.uniform(-0.2, 0.2, (STARTS, z.shape[1]))
    z[:, model.actuated] = q
    z = model.newton(z, model.actuated)
    return q, model.tip(z[model.gap(z) < CLOSED])


@pytest.mark.parametrize("make", [hexa, twisted_delta, tripod])
def test_leg_inverse_recovers_generating_actuators(make):
    q, T = drawn(make)
    assert len(T)
    found, residual = solved(make)(T)
    back = np.abs(np.remainder(found - q + np.pi, 2 * np.pi) - np.pi).max(-1) < 1e-7
    assert (back & (residual < 1e-9)).any(0).all()


def test_pose_outside_three_dof_workspace_has_no_solution():
    T = drawn(twisted_delta)[1][:1].copy()
    ik = solved(twisted_delta)
    assert ik(T)[1].min() < 1e-9
    T[:, :3, :3] = T[:, :3, :3] @ [
        [np.cos(0.01), -np.sin(0.01), 0],
        [np.sin(0.01), np.cos(0.01), 0],
        [0, 0, 1],
    ]
    assert np.nanmin(ik(T)[1]) > 1e-5


def test_tripod_pose_has_a_single_solution():
    ik, T = solved(tripod), drawn(tripod)[1].copy()
    q, residual = ik(T)
    assert len(q) > 1
    assert ((residual < 1e-9).sum(0) == 1).all()
    T[:, 0, 3] += 1e-4
    assert ik(T)[1].min() > 1e-6


def test_all_64_branches_of_hexa_solve_a_pose():
    T = np.eye(4)[None].repeat(POSES, 0)
    T[:, :3, 3] = np.random.default_rng(1).uniform(-0.03, 0.03, (POSES, 3))
    T[:, 2, 3] += 0.38
    q, residual = solved(hexa)(T)
    assert residual.shape == (64, POSES)
    assert residual.max() < 1e-12
    apart = np.abs(q[:, None] - q[None]).max(-1) + np.eye(64)[..., None]
    assert apart.min() > 1e-3
