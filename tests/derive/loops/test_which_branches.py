"""Tests the number and names of the branches of functions between joints, and notes about omitted
functions."""

import json
from dataclasses import replace

import pytest
import sympy as sp

from chasles.derive import Frame, Joint, Mechanism, Strut, derive, files
from chasles.derive.loops.solve import solved_loops
from chasles.derive.loops.solve.solved_loops import forward_branches
from chasles.derive.model.mechanism import Closure
from tests.support.loops.mechanisms import BASE, at, excavator_arm, near, parallelogram, pin, slider
from tests.support.loops.solved import solved


def in_a_row(count):
    """Return four-bar linkages in series, each mounted on the rocker of the preceding linkage."""
    joints, closures, reference, on = [], [], [], BASE
    for k in range(count):
        joints += [
            pin(f"crank{k}", on, f"crank{k}_b", 2 if k else 0),
            pin(f"coupler{k}", f"crank{k}_b", f"coupler{k}_b", 1),
            pin(f"rocker{k}", on, f"rocker{k}_b", 5 if k else 3),
        ]
        ends = Frame(f"coupler{k}_b", at(3)), Frame(f"rocker{k}_b", at(2))
        closures.append(Closure(f"pin{k}", "pin", *ends))
        reference += [(f"crank{k}", 1), (f"coupler{k}", "-1/2"), (f"rocker{k}", 2)]
        on = f"rocker{k}_b"
    return Mechanism(
        "row",
        tuple(joints),
        tuple(f"crank{k}" for k in range(count)),
        closures=tuple(closures),
        reference=near(*reference),
    )


def labels(mechanism, name):
    return derive(mechanism, functions=[name]).function(name).role.labels


def test_branches_of_serial_four_bars_multiply():
    found = labels(in_a_row(3), "chain_all")
    assert len(set(found)) == 8
    assert found[0] == "pin0 left, pin1 left, pin2 left"
    assert found[-1] == "pin0 right, pin1 right, pin2 right"


def test_branches_beyond_the_maximum_are_cut_and_noted(monkeypatch):
    monkeypatch.setattr(solved_loops, "MAX_BRANCHES", 4)
    made = files(in_a_row(3), functions=["chain", "chain_all"])
    content = json.loads(made["manifest.json"])
    (function,) = [f for f in content["functions"] if f["name"] == "chain_all"]
    assert function["outputs"][0]["shape"] == [4, 3]
    assert "chain_all has 4 of more than 4 branches" in content["notes"]


def test_cylinder_length_adds_no_branch():
    assert labels(excavator_arm(), "actuators_all") == ("the only one",)
    assert labels(excavator_arm(), "chain_all") == ("lift right", "lift left")


def uneven(count):
    """Return a parallelogram linkage with several cranks and unequal side lengths."""
    others = [
        Strut(f"rod{k}", Frame(BASE, at(k)), Frame("coupler", at(k)), 1)
        for k in range(2, count + 1)
    ]
    return Mechanism(
        "uneven",
        (pin("crank", BASE, "arm"), pin("bar", "arm", "coupler", 1)),
        ("crank",),
        struts=tuple(others),
        tool_body="coupler",
        reference=near(("crank", 1), ("bar", -1), *((s.swing_name, 1) for s in others)),
    )


def test_parallelogram_has_parallel_and_crossed_branches():
    assert labels(uneven(2), "chain_all") == ("rod2 parallel", "rod2 crossed")
    crossed = near(("crank", 1), ("bar", "-9/5"), ("rod2_swing", "-9/5"))
    assert labels(replace(uneven(2), reference=crossed), "chain_all") == (
        "rod2 crossed",
        "rod2 parallel",
    )


@pytest.mark.parametrize("cranks", [3, 4])
def test_third_crank_leaves_only_the_parallel_branch(cranks):
    assert labels(uneven(cranks), "chain_all") == ("rod2 parallel",)


def test_rhombus_has_a_folded_branch():
    h = solved(parallelogram(2))
    own, other = (solution.values for solution in forward_branches(h))
    assert sp.expand(own["bar"] + h.q[0]) == 0
    assert sp.expand(own["crank1"] - h.q[0]) == 0
    # On the second branch of the linkage, the bar lies along the first crank, and the second crank
    # along the ground link.
    assert not h.terms.is_solved(other["bar"])
    assert sp.expand(other["bar"]) in (sp.pi, -sp.pi)
    assert sp.expand(other["crank1"]) in (sp.pi, -sp.pi)


def test_loops_that_do_not_move_the_tool_add_no_branch():
    whole = in_a_row(2)
    inner = replace(whole, tool_body="rocker0_b")
    assert labels(inner, "chain_all") == ("pin0 left", "pin0 right")


def scissor_lift():
    """Two pairs of crossed bars. A crank rotates the first bar, whose other foot slides."""
    along_x = ("y", sp.pi / 2)
    joints = (
        pin("crank", BASE, "right"),
        slider("foot", BASE, "foot_b", 0, 0, 0, along_x),
        Joint(
            "left",
            "revolute",
            before=at(0, 0, 0, ("y", -sp.pi / 2)),
            link="left_b",
            parent="foot_b",
        ),
        pin("upper_left", "right", "upper_left_b", 2),
        pin("upper_right", "left_b", "upper_right_b", 2),
    )
    closures = (
        Closure("cross", "pin", Frame("right", at(1)), Frame("left_b", at(1))),
        Closure("upper", "pin", Frame("upper_left_b", at(1)), Frame("upper_right_b", at(1))),
    )
    reference = near(
        ("crank", "0.6"),
        ("foot", "1.65"),
        ("left", "2.54"),
        ("upper_left", "1.9"),
        ("upper_right", "-1.9"),
    )
    return Mechanism(
        "lift", joints, ("crank",), closures=closures, tool_body="upper_left_b", reference=reference
    )


def test_folded_scissor_lift_has_no_branch():
    """If both base pivots of the lift coincide, the upper bars may rotate about one point."""
    assert labels(scissor_lift(), "chain_all") == (
        "cross far, upper right",
        "cross far, upper left",
    )
