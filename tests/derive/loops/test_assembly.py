"""The closed form of planar loops selects the intended branch and needs few square roots."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import sympy as sp

from chasles.derive import DescriptionError, Rotation, Translation, derive, read_text
from chasles.derive.loops.planar.parallelogram import CrossedParallelogram, Parallelogram
from chasles.derive.loops.planar.pin_pin_slide import TwoPinsAndSlide
from chasles.derive.loops.planar.pin_slide_slide import PinAndTwoSlides
from chasles.derive.loops.planar.three_pins import ThreePins
from chasles.derive.loops.planar.two_pins import TwoPins
from chasles.derive.model.mechanism import Closure, Frame, Mechanism, Strut
from chasles.derive.model.robot import Joint, Parameter
from chasles.derive.terms.casadi_graph import lower
from tests.support.derivations import ROBOTS
from tests.support.loops.closures import Model
from tests.support.loops.mechanisms import (
    ALONG_X,
    ALONG_Y,
    BACK,
    BASE,
    at,
    excavator_arm,
    four_bar,
    four_bar_rod,
    geared,
    ground,
    near,
    parallelogram,
    pin,
    planar_3rrr,
    slider,
    slider_crank,
    slotted_rocker,
    trammel,
    welded,
)
from tests.support.loops.solved import forward, solved

CLOSED = 1e-12
UP = ("x", sp.pi / 2)


def oldham():
    """A mechanism with two perpendicular sliders on a rotating block.

    The unknown joints are one pin and two prismatic joints.
    """
    return Mechanism(
        "oldham",
        (
            slider("low", BASE, "cross", 0, 0, 0, ALONG_X, after=at(0, 0, 0, BACK)),
            slider("high", "cross", "plate", 0, 0, 0, ALONG_Y, after=at(0, 0, 0, UP)),
            pin("crank", BASE, "arm", 1, "1/3"),
        ),
        ("crank",),
        closures=(Closure("eye", "pin", Frame("arm", at("3/4")), Frame("plate", at("1/5"))),),
        tool_body="plate",
        reference=near(("crank", 1)),
    )


def crank_slider_offset():
    """A slider drives a crank through a rod."""
    return Mechanism(
        "press",
        (
            slider("ram", BASE, "ram", 0, "1/4", 0, ALONG_X),
            pin("crank", BASE, "wheel"),
        ),
        ("ram",),
        struts=(Strut("rod", Frame("wheel", at(1)), Frame("ram"), 3),),
        tool_body="wheel",
        reference=near(("ram", "13/4"), ("crank", 1), ("rod_swing", -1)),
    )


def cylinder_and_rod():
    """A rocker with a cylinder and a rod to a lever, as on an excavator bucket."""
    return Mechanism(
        "bucket",
        (pin("rocker", BASE, "rocker", -1), pin("bucket", BASE, "bucket")),
        ("cylinder",),
        struts=(
            Strut("cylinder", Frame(BASE, at(-4, 1)), Frame("rocker", at(1)), 3, True),
            Strut("link", Frame("rocker", at(1)), Frame("bucket", at("1/5", "4/5")), 1),
        ),
        reference=near(
            ("rocker", "3/2"),
            ("cylinder_swing", 0),
            ("link_swing", -2),
            ("bucket", "1/10"),
        ),
    )


def backwards():
    """A four-bar with reversed joints and a flipped axis."""
    whole = four_bar()
    crank, elbow, rocker = whole.joints
    over = (*rocker.before, Rotation("x", sp.pi))
    joints = (replace(crank, direction=-1), elbow, replace(rocker, before=over))
    where = Frame("output", (Translation((whole.parameters[2].symbol, 0, 0)),))
    (wrist,) = whole.closures
    return replace(
        whole,
        joints=joints,
        closures=(replace(wrist, b=where),),
        reference=near(("crank", -sp.pi / 3), ("elbow", "-1/2"), ("rocker", "-3/2")),
    )


def tilted(build):
    def made():
        turned = at("1/2", -1, "1/3", ("x", sp.Rational(7, 10)), ("y", sp.pi / 5), ("z", 1))
        return ground(build(), turned)

    made.__name__ = f"tilted_{build.__name__}"
    return made


KINDS = {
    four_bar: [ThreePins],
    four_bar_rod: [ThreePins],
    geared: [ThreePins],
    welded: [ThreePins],
    slider_crank: [TwoPinsAndSlide],
    slotted_rocker: [TwoPinsAndSlide],
    crank_slider_offset: [ThreePins],
    oldham: [PinAndTwoSlides],
    parallelogram: [Parallelogram, Parallelogram],
    cylinder_and_rod: [ThreePins, ThreePins],
    backwards: [ThreePins],
    tilted(slider_crank): [TwoPinsAndSlide],
    tilted(excavator_arm): [ThreePins],
}
BUILDERS = {build.__name__: build for build in KINDS}
SINGLE = ("slotted_rocker", "oldham", "parallelogram")
"""Names of mechanisms whose loops have only one solution."""


@cache
def derived(name):
    names = ["chain", "configuration"] + ["chain_all"] * (name not in SINGLE)
    return derive(BUILDERS[name](), functions=names)


def hybrid(name):
    return derived(name).hybrid


@cache
def kernels(name):
    functions = derived(name).functions
    names = [f.name for f in functions]
    return dict(zip(names, lower(functions, "test"), strict=True))


def random_q(name, n=40):
    h = hybrid(name)
    known = h.at_reference
    reference = np.array([known[c.moves] / float(c.ratio) for c in h.mechanism.coordinates])
    generator = np.random.default_rng(0)
    spread = 3.0 if name == "geared" else 0.25
    return reference + generator.uniform(-spread, spread, (n, len(reference)))


def configurations(name, q):
    f = kernels(name)["configuration"]
    return np.array([np.array(f(row)).ravel() for row in q])


@pytest.mark.parametrize("build", KINDS, ids=lambda build: build.__name__)
def test_planar_loops_are_solved_by_textbook_groups(build):
    h = hybrid(build.__name__)
    kinds = [type(step) for step in h.forward.steps]
    assert kinds == KINDS[build] or kinds == [*KINDS[build][:1], TwoPins]
    assert not h.forward.open


@pytest.mark.parametrize("name", BUILDERS)
def test_solved_configurations_close_all_loops(name):
    model, q = Model(BUILDERS[name]()), random_q(name)
    z = configurations(name, q)
    assert np.isfinite(z).all()
    np.testing.assert_allclose(z[:, model.actuated], q * model.ratio, atol=1e-15)
    assert model.gap(z).max() < CLOSED


@pytest.mark.parametrize("name", BUILDERS)
def test_newton_from_reference_converges_to_the_solved_branch(name):
    """Newton's method starts at the reference of the robot description."""
    h = hybrid(name)
    given = dict(h.mechanism.reference)
    model = Model(BUILDERS[name]())
    known = [h.at_reference[n] for n in model.names]
    start = [float(given.get(n, h.at_reference[n])) for n in model.names]
    start = np.array([np.where(np.isin(range(len(known)), model.actuated), known, start)])
    found = model.newton(start, model.actuated)
    assert model.gap(found).max() < CLOSED
    np.testing.assert_allclose(np.exp(1j * found[0]), np.exp(1j * np.array(known)), atol=1e-9)


@pytest.mark.parametrize("name", BUILDERS)
def test_every_row_of_chain_all_closes(name):
    if name in SINGLE:
        assert hybrid(name).forward.margins == ()
        return
    f = kernels(name)
    model, q = Model(BUILDERS[name]()), random_q(name, 2)
    generator = np.random.default_rng(1)
    for row in q:
        count = 2 ** len(hybrid(name).forward.margins)
        theta = np.array(f["chain_all"](row)[0]).reshape(count, -1)
        np.testing.assert_allclose(theta[0], np.array(f["chain"](row)).ravel(), atol=CLOSED)
        z = generator.uniform(-3, 3, (20, len(model.names)))
        known = sorted({*model.chain, *model.actuated})
        for values in theta[np.isfinite(theta).all(-1)]:
            z[:, model.chain] = values
            z[:, model.actuated] = row * model.ratio
            assert model.gap(model.newton(z, known)).min() < CLOSED


def test_four_bar_branches_are_named_left_and_right():
    h = hybrid("four_bar")
    (step,) = h.forward.steps
    assert step.name(h.mechanism) == "wrist"
    assert (step.branch, step.sign) in [("left", 1), ("right", -1)]
    whole = four_bar()
    flipped = replace(whole, reference=near(("crank", sp.pi / 3), ("elbow", -2), ("rocker", -2)))
    (other,) = solved(flipped).forward.steps
    assert {step.branch, other.branch} == {"left", "right"}


def test_slider_crank_branches_are_named_far_and_near():
    (step,) = hybrid("slider_crank").forward.steps
    assert (step.branch, step.sign) == ("far", 1)
    mirrored = near(("crank", 1), ("elbow", sp.pi - 1), ("cross", -2))
    (other,) = solved(replace(slider_crank(), reference=mirrored)).forward.steps
    assert (other.branch, other.sign) == ("near", -1)


def test_slotted_rocker_with_unit_crank_inverts_and_differentiates():
    """At crank length 1, the offset of the crank pin is the sine of the solved angle."""
    derived = derive(slotted_rocker(), functions=["chain", "actuators", "actuators_D_chain"])
    chain, actuators, slope = lower(derived.functions, "test")
    for q in (0.3, 0.5, 0.9):
        theta = np.array(chain(q)).ravel()
        assert float(actuators(theta)) == pytest.approx(q, abs=1e-12)
        step = 1e-6 * np.eye(len(theta))
        rises = [float(actuators(theta + e)) - float(actuators(theta - e)) for e in step]
        np.testing.assert_allclose(
            np.array(slope(theta)).ravel(), np.array(rises) / 2e-6, atol=1e-8
        )


# --- ambiguous and missing branches ---


def test_reference_between_two_branches_is_rejected():
    symmetric = replace(four_bar(), reference=near(("crank", 0)))
    with pytest.raises(
        DescriptionError, match=r"four_bar.*(elbow|rocker|wrist).*: the loop .*dead point"
    ):
        derive(symmetric)
    between = near(("crank", 0), ("elbow", 0), ("rocker", 0))
    with pytest.raises(DescriptionError, match="rocker") as caught:
        derive(replace(four_bar(), reference=between))
    for joint in ("elbow", "rocker", "wrist"):
        assert joint in str(caught.value)
    derive(
        replace(four_bar(), reference=near(("crank", 0), ("elbow", "1/10"))), functions=["chain"]
    )


def test_loop_open_at_the_reference_is_rejected():
    far = replace(slider_crank(), reference=near(("crank", "3/2")))
    rod = replace(far.closures[0], a=Frame("rod", at("1/2")))
    with pytest.raises(
        DescriptionError, match=r"loop of 'gudgeon' does not close at the ref.* 247.5 mm apart"
    ):
        derive(replace(far, closures=(rod,)))


@pytest.mark.parametrize("cranks", [3, 4])
def test_parallelogram_with_redundant_cranks_is_solved(cranks):
    mechanism = parallelogram(cranks)
    h = solved(mechanism)
    assert not h.forward.open
    assert not h.forward.margins
    derived = derive(mechanism, functions=["configuration", "chain_D_q"])
    chain_D_q, configuration = lower(derived.functions, "test")
    model = Model(mechanism)
    for q in (0.2, 1.0, 2.9):
        z = np.array(configuration(q)).reshape(1, -1)
        assert model.gap(z).max() < CLOSED
        np.testing.assert_allclose(z[0], [q, -q, *[q] * (cranks - 1)], atol=1e-14)
        np.testing.assert_allclose(np.array(chain_D_q(q)).ravel(), [1, -1], atol=0)


def test_trammel_positions_margins_and_branches_are_correct():
    derived = derive(trammel(), functions=["configuration", "margin", "chain_all"])
    configuration, margin, every = lower(derived.functions, "test")
    for x in np.linspace(-0.99, 0.99, 9):
        found_x, y, _ = np.array(configuration(x)).ravel()
        assert found_x == x
        assert y == pytest.approx(np.sqrt(1 - x**2))
        assert float(margin(x)) == pytest.approx(1 - x**2)
        rows = np.array(every(x)[0]).reshape(2, -1)
        assert rows[:, 0] == pytest.approx([y, -y])


INVERSE = ["actuators", "actuators_all", "constraint", "rods", "assembly_polynomial"]


def test_class_iii_mechanism_has_only_a_closed_form_inverse():
    mechanism = planar_3rrr()
    made = derive(mechanism, functions=[*INVERSE, "chain"])
    h = made.hybrid
    assert {"x", "y", "roll", "pitch", "yaw"} & set(h.forward.open)
    assert not set(h.backward.open) & {c.moves for c in mechanism.coordinates}
    # The function `chain` calls the loop solver, and the inverse functions call no solver.
    called = {f.name: [call.entry for call in f.calls] for f in made.functions}
    assert called["chain"] == ["at"]
    assert {called[name] == [] for name in INVERSE} == {True}


def test_undriven_parts_stay_open_without_blocking_other_loops():
    whole = four_bar()
    loose = Joint("loose", "revolute", before=at("1/2"), link="pendulum", parent="coupler")
    second = Joint("second", "revolute", before=at("1/2"), link="bob", parent="pendulum")
    tied = Strut("tie", Frame("output", at("1/2")), Frame("bob", at("1/2")), 2)
    mechanism = replace(whole, joints=(*whole.joints, loose, second), struts=(tied,))
    assert set(forward(mechanism).open) == {"loose", "second", "tie_swing"}


def test_reference_is_converted_through_drive_with_named_radius():
    text = (ROBOTS / "bricklaying_gantry.toml").read_text(encoding="utf-8").split("[reference]")[0]
    assert "limits = [0, 400]" in text
    robot = read_text(text.replace("limits = [0, 400]", "limits = [3, 400]"), file="gantry.toml")
    h = solved(robot)
    motors = [float(value) for value in map(h.forward.reference.of, h.q)]
    assert motors == pytest.approx([0.2015 / 0.010, 0, 0], abs=1e-12)
    assert h.at_reference["x"] == pytest.approx(0.2015, abs=1e-15)


def test_parallelogram_angles_are_solved_without_square_root():
    L, M = (Parameter(name, value) for name, value in (("L", "6/5"), ("M", "1/2")))
    l, m = L.symbol, M.symbol  # noqa: E741
    mechanism = Mechanism(
        "lamp",
        (pin("arm", BASE, "arm"), pin("shade", "arm", "shade", l)),
        ("arm",),
        struts=(Strut("stay", Frame(BASE, at(0, m)), Frame("shade", at(0, m)), l),),
        parameters=(L, M),
        reference=near(("arm", 1), ("shade", -1), ("stay_swing", 1)),
    )
    h = solved(mechanism)
    (step,) = h.forward.steps
    assert type(step) is Parallelogram
    assert sp.expand(h.forward.values["shade"] + h.q[0]) == 0
    assert h.forward.values["stay_swing"] == h.q[0]
    # Separate equations without a square root solve the crossed assembly mode of the linkage.
    crossed = replace(
        mechanism, reference=near(("arm", 1), ("shade", "-14/5"), ("stay_swing", "1/3"))
    )
    (step,) = solved(crossed).forward.steps
    assert type(step) is CrossedParallelogram
    assert step.margin is None
