"""A reference configuration selects a loop branch even if it omits some joints of the loop."""

import cmath

import numpy as np
import pytest

from chasles.derive.description.robot_files import read_text
from chasles.derive.terms.casadi_graph import lower
from chasles.derive.terms.symbolic_function import Result, SymbolicFunction
from tests.support.loops.solved import solved

BAR = """
[[joints]]
name = "{name}"
link = "{name}"
parent = "{parent}"
xyz = [{x}, 0, 0]
axis = [0, 0, 1]
"""
SLIDE = """
[[joints]]
name = "{name}"
link = "{name}"
parent = "{parent}"
type = "prismatic"
axis = [1, 0, 0]
"""
PIN = """
[[closures]]
name = "{name}"
kind = "pin"
a = {{ body = "{a}", xyz = [{x}, 0, 0] }}
b = {{ body = "{b}", xyz = [{y}, 0, 0] }}
"""


def scissor_lift(sign, ram):
    """A lift with two pairs of crossed bars of length 1.2 m, opened by a ram."""
    text = 'name = "lift"\nconvention = "urdf"\nactuated = ["ram"]\nunits = { angle = "deg" }\n'
    way = (("a0", "0", 0), ("b0", "a0", 0.6), ("a1", "b0", 0.6), ("b1", "a1", 0.6))
    text += "".join(BAR.format(name=name, parent=parent, x=x) for name, parent, x in way)
    text += SLIDE.format(name="foot", parent="0")
    text += PIN.format(name="p1", a="a0", b="b1", x=1.2, y=-0.6)
    text += PIN.format(name="slide", a="b0", b="foot", x=-0.6, y=0)
    (a, x), (b, y) = ram
    text += f'[[cylinders]]\nname = "ram"\na = {{ body = "{a}", xyz = [{x}, 0, 0] }}\n'
    text += f'b = {{ body = "{b}", xyz = [{y}, 0, 0] }}\n[reference]\n'
    bars = {"a0": 30, "b0": 120, "a1": -120, "b1": 120}
    text += "".join(f"{name} = {sign * value}\n" for name, value in bars.items())
    return read_text(f"{text}foot = 1.03923\nram = {ram_length(ram, np.pi / 6)}")


def ram_length(ram, angle):
    middle = {"a0": 0.6 * cmath.exp(1j * angle)}
    middle["b1"] = complex(middle["a0"].real, 3 * middle["a0"].imag)
    points = {
        "a0": lambda x: x * cmath.exp(1j * angle),
        "b1": lambda x: middle["b1"] - x * cmath.exp(-1j * angle),
    }
    (a, x), (b, y) = ram
    return abs(points[a](x) - points[b](y))


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("ram", [(("a0", 0.2), ("b1", -0.2)), (("b1", 0.1), ("a0", 0.3))])
def test_reference_selects_branch_of_ring_without_stated_joint(ram, sign):
    hybrid = solved(scissor_lift(sign, ram))
    assert not hybrid.forward.open
    chain = hybrid.forward.values
    value = lower_values(hybrid, [chain[name] for name in ("a0", "b0")], ram_length(ram, 0.7))
    expected = sign * np.array([0.7, np.pi - 1.4])
    assert np.abs(np.angle(np.exp(1j * (value - expected)))).max() < 1e-12


def lower_values(hybrid, entries, length):
    """Evaluate symbolic terms at a value of the actuated coordinate."""
    result = Result("values", tuple(entries), (len(entries),), "rad", "joints")
    q = hybrid.arguments["q"]
    function = SymbolicFunction("values", "Values.", "", (q,), (result,), hybrid.terms)
    return np.array(lower([function], "lift")[0]([length])).ravel()
