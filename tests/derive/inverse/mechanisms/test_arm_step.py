"""Loops whose unknown joints form a serial arm, compared with Newton's method on a NumPy model."""

import numpy as np
import pytest
from test_leg_chains import slots_at

from chasles.derive import derive, explain, read_text
from chasles.derive.latex import files
from chasles.derive.program.programs import NO_PROGRAMS
from chasles.derive.terms.casadi_graph import lower
from tests.support.generators.leg_platforms import LEG_KINDS, drawn_as
from tests.support.generators.machine_platforms import MACHINE_KINDS
from tests.support.loops.assembly_modes import closes_at
from tests.support.loops.closures import Model, wrapped

POSES, CLOSED, SAME = 20, 1e-12, 1e-12
REACH = {"revolute": 0.2, "prismatic": 0.05}
"""Maximum distance of a coordinate from the reference (radian or meter)."""
STEP, CURVED = 1e-5, 1e-3
"""Step of a second difference (s), and its error relative to the largest acceleration."""
KINDS = {kind: draw for kind, draw in LEG_KINDS.items() if kind not in ("3-PUU", "3-RUU")}
KINDS |= {name: MACHINE_KINDS[name] for name in ("Exechon with a head", "pentapod")}
"""Platforms; 3-PUU and 3-RUU are also drawn with offsets, which take the same steps."""
SHORT = {"pentapod": 0.1}
"""Fraction of the reach in which Newton's method converges, for platforms near a singularity."""
MAPS = ("actuators", "actuators_D_chain", "actuator_rates", "actuator_accelerations")
FORWARD = ("fk", "chain", "chain_D_q", "chain_all")
SHAFT = read_text("""
name = "shaft"
convention = "urdf"
actuated = ["motor", "slide"]
units = { length = "mm", angle = "deg" }
tool = { body = "tool", xyz = [40, 0, 0] }

[[joints]]
name = "slide"
parent = "0"
link = "carriage"
type = "prismatic"
xyz = [120, 50, 0]
rpy = [0, 20, 0]
axis = [0, 0, 1]

[[joints]]
name = "tool"
parent = "carriage"
link = "tool"
axis = [0, 0, 1]

[[joints]]
name = "motor"
parent = "0"
link = "motor"
axis = [0, 0, 1]

[[joints]]
name = "a"
parent = "motor"
link = "a"
axis = [1, 0, 0]

[[joints]]
name = "b"
parent = "a"
link = "b"
axis = [0, 1, 0]

[[joints]]
name = "telescope"
parent = "b"
link = "telescope"
type = "prismatic"
axis = [0, 0, 1]

[[joints]]
name = "c"
parent = "telescope"
link = "c"
axis = [0, 1, 0]

[[joints]]
name = "d"
parent = "c"
link = "d"
axis = [1, 0, 0]

[[closures]]
name = "end"
kind = "weld"
a = { body = "d" }
b = { body = "tool" }

[reference]
slide = 400
telescope = 458
a = -7.6
b = 34.1
c = -14
d = 7.6
""")
"""A telescopic Cardan shaft between a motor and a tool on a carriage."""


@pytest.fixture(scope="module", params=KINDS)
def platform(request):
    """Returns kernels of a platform, and closed configurations (N, n_z) near its reference."""
    mechanism = drawn_as(KINDS[request.param], 0)
    functions = kernels(mechanism, (*MAPS, "actuator_margin"))
    return functions, *configurations(mechanism, SHORT.get(request.param, 1.0))


def configurations(mechanism, part=1.0):
    """Returns a model and closed configurations (N, n_z) near the reference of a mechanism."""
    model, rng = Model(mechanism), np.random.default_rng(0)
    at = dict(mechanism.reference)
    z = np.repeat([[float(at.get(name, 0)) for name in model.names]], POSES, 0)
    z = model.newton(z, model.actuated)
    reach = [part * REACH[c.kind] for c in mechanism.coordinates]
    step = rng.uniform(-1, 1, (POSES, len(reach))) * reach
    known = z[:, model.actuated] + step
    z += (model.tangent(z, model.actuated) @ step[..., None])[..., 0]
    z[:, model.actuated] = known
    z = model.newton(z, model.actuated)
    z = z[model.gap(z) < CLOSED]
    assert len(z) > POSES / 2
    return model, z


def kernels(mechanism, names):
    """Returns the named functions and their CasADi kernels; each function has a closed form."""
    found = derive(mechanism, functions=names)
    functions = [found.function(name) for name in names]
    assert not any(function.calls for function in functions)
    return dict(zip(names, zip(functions, lower(functions, "arms"), strict=True), strict=True))


def evaluated(kernels, names, *inputs):
    """Returns the first result (N, ...) of each named function."""
    results = []
    for function, kernel in (kernels[name] for name in names):
        values = kernel(*(x.T for x in inputs[: len(function.inputs)]))
        first = values[0] if isinstance(values, list | tuple) else values
        results.append(np.array(first).T.reshape(-1, *function.outputs[0].shape))
    return results


def test_actuators_of_iterated_platforms_have_a_closed_form(platform):
    functions, model, z = platform
    rates = np.random.default_rng(1).normal(size=(len(z), len(model.actuated)))
    slope = model.z_D_q(z)
    zd = np.einsum("nij,nj->ni", slope, rates)
    moved = [model.newton(z + side * STEP * zd, model.actuated) for side in (1, -1)]
    zdd = (moved[0] + moved[1] - 2 * z) / STEP**2
    theta, thetad, thetadd = (values[:, model.chain] for values in (z, zd, zdd))
    q, slopes, qd, qdd = evaluated(functions, MAPS, theta, thetad, thetadd)
    assert np.abs(wrapped(q - z[:, model.actuated])).max() < SAME
    products = slopes @ slope[:, model.chain]
    assert np.abs(products - np.eye(len(model.actuated))).max() < 100 * SAME
    assert np.abs(qd - rates).max() < 100 * SAME
    assert np.abs(qdd).max() < CURVED * max(1.0, np.abs(thetadd).max())


def test_joints_that_loops_exclude_have_no_actuators(platform):
    functions, model, z = platform
    theta = z[:, model.chain] + 1e-3 * np.arange(1, len(model.chain) + 1)
    q, margin = evaluated(functions, ("actuators", "actuator_margin"), theta)
    assert np.isnan(q).any(-1).all()
    assert (margin.min(-1) < 0).all()


def test_explanation_lists_the_arms():
    text = str(explain(drawn_as(LEG_KINDS["tripteron"], 1)))
    assert "pin_y: serial arm between known bodies, for pin_y, y2, py, y1; branch: -" in text
    assert "no closed form" not in text


def test_shaft_turns_the_tool_in_closed_form():
    model, z = configurations(SHAFT)
    q, theta, slope = z[:, model.actuated], z[:, model.chain], model.z_D_q(z)
    functions = kernels(SHAFT, (*FORWARD, "actuators"))
    pose, chain, slopes, rows = evaluated(functions, FORWARD, q)
    assert np.abs(pose - model.tip(z)).max() < SAME
    assert np.abs(wrapped(chain - theta)).max() < SAME
    assert np.abs(slopes - slope[:, model.chain]).max() < 100 * SAME
    (back,) = evaluated(functions, ("actuators",), theta)
    assert np.abs(wrapped(back - q)).max() < SAME
    assert np.isfinite(rows).all()
    assert all(closes_at(model, row, q[0]) for row in rows[0])


def test_shaft_slots_contain_the_generating_coordinates():
    model, z = configurations(SHAFT)
    ik = derive(SHAFT, functions=["ik"]).function("ik")
    q, residual = slots_at(ik, model.tip(z))
    own = np.abs(wrapped(q - z[:, model.actuated])).max(-1) < 100 * SAME
    assert (own & (residual < 100 * SAME)).any(0).all()


def test_article_prints_no_rate_of_an_arm():
    printed = files(derive(SHAFT, functions=["fk", "chain_rates"]), NO_PROGRAMS)
    assert r"\textbf{Step 1: serial arm between known bodies}" in printed["latex/solution.tex"]
    rates = printed["latex/rates.tex"]
    assert r"$\dot{\theta}_{2}$ follows from $\frac{\partial c}{\partial z}" in rates
    assert r"\dot{\theta}_{2} &= 0" not in rates
