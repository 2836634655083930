"""Loops whose unknown joints form a serial arm, compared with Newton's method on a NumPy model."""

import numpy as np
from test_leg_chains import SAME, configurations, evaluated, kernels, slots_at

from chasles.derive import derive, explain, read_text
from chasles.derive.latex import files
from chasles.derive.program.programs import NO_PROGRAMS
from tests.support.generators.leg_platforms import LEG_KINDS, drawn_as
from tests.support.loops.assembly_modes import closes_at
from tests.support.loops.closures import wrapped

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
