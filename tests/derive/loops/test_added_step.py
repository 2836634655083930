"""Test that one new class adds a solution step to the loop solver and to the LaTeX article."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
import sympy as sp
from test_loop_steps import Numbers

from chasles.derive import Frame, Mechanism, Parameter, Strut, derive
from chasles.derive.latex import fragments
from chasles.derive.loops.model.phasors import REAL, cross
from chasles.derive.loops.planar import assembly
from chasles.derive.loops.planar.arm import Arm, arm, rates_of, turn_of
from chasles.derive.loops.planar.clusters import PlanarStep
from chasles.derive.loops.planar.dyads import SIDES, dyad_of, join_dyad, side_of
from chasles.derive.loops.planar.loop_step import (
    AngleEquation,
    RateEquation,
    StepEquations,
    components,
    length_of,
    quantity,
    weighted,
)
from chasles.derive.loops.planar.three_pins import ThreePins
from chasles.derive.terms.casadi_graph import lower
from chasles.derive.terms.tangents import Tangent
from tests.support.loops.closures import Model
from tests.support.loops.mechanisms import BASE, at, four_bar, near, pin
from tests.support.loops.solved import solved

HALF = sp.Rational(1, 2)


@dataclass(frozen=True, kw_only=True)
class Isosceles(PlanarStep):
    """Three pins in an isosceles triangle whose two arms have equal constant lengths.

    The third pin has the position C = D/2 + k J D. D is the vector along the base of the triangle,
    k^2 = (arm length)^2 / |D|^2 - 1/4, and J is the rotation by 90 degrees.
    """

    base: Arm
    arms: tuple[Arm, Arm]

    title: ClassVar[str] = "an isosceles triangle"
    branches: ClassVar[dict[int, str]] = SIDES

    @classmethod
    def join(cls, clusters):
        for pins in clusters.rings(slides=0):
            terms, dyad = clusters.terms, dyad_of(clusters, pins)
            v, w, d = (arm(terms, vector) for vector in (dyad.V, dyad.W, dyad.D))
            if v.square != w.square or not terms.is_constant(v.square):
                continue
            sign = clusters.sign(side_of(clusters, dyad), dyad.pins)
            inside = terms.let(v.square / d.square - sp.Rational(1, 4))
            k = terms.let(sign * sp.sqrt(inside))
            angles = []
            for here, half in ((v, HALF), (w, -HALF)):
                there = above(terms, d.vector, half, k)
                angle = clusters.solved(*turn_of(terms, there, here), rate(d, there, half, k))
                angles.append(angle)
            first, second = angles
            turns = (d.angle + first - v.angle, REAL), (d.angle + second - w.angle, REAL)
            joints, axes, relation = join_dyad(clusters, dyad, *turns)
            step = cls(
                joints=joints,
                axes=axes,
                relation=relation,
                turned=d.angle,
                solved=(first, second),
                # The margin of the isosceles triangle is sin^2 of the angle between its arms.
                margin=terms.let(inside * d.square**2 / v.square**2),
                sign=sign,
                base=d,
                arms=(v, w),
            )
            clusters.steps.append(step)
            return True
        return False

    def equations(self):
        D, C, E = (components(letter) for letter in "DCE")
        d, a, k = length_of("D"), length_of("A"), quantity("k")
        rates = []
        for angle, there, half in zip(self.solved, (C, E), (HALF, -HALF), strict=True):
            across = cross(there, (-D[1], D[0]))
            slope = [-(a**2) * part / (d**4 * k) * across for part in D]
            straight = [half * x for x in (-there[1], there[0])]
            aside = [k * x for x in there]
            weights = [sum(parts) for parts in zip(slope, straight, aside, strict=True)]
            rates.append(RateEquation(((angle, a**2),), weighted(D, tuple(weights))))
        return StepEquations(
            vectors={"D": self.base.vector, "A": self.arms[0].vector, "B": self.arms[1].vector},
            lengths=("D", "A"),
            results=(
                (k, self.sign * sp.sqrt(a**2 / d**2 - sp.Rational(1, 4))),
                (C[0], HALF * D[0] - k * D[1]),
                (C[1], HALF * D[1] + k * D[0]),
                (E[0], C[0] - D[0]),
                (E[1], C[1] - D[1]),
            ),
            angles=tuple(map(AngleEquation, self.solved, "AB", (C, E))),
            margin=k**2 * d**4 / a**4,
            rates=tuple(rates),
        )

    @property
    def remark(self):
        return f"The far pin is above the middle of ${{D}}$, on its {self.branch}."


def above(terms, D, half, k):
    """Return the vector to the third pin of the triangle, from the start of the base vector D."""
    x, y = D
    return terms.let(half * x - k * y), terms.let(half * y + k * x)


def rate(d, there, half, k):
    """Return a function that computes the angular rate of a link from a tangent vector."""

    def loop(tangent):
        terms, (x, y) = tangent.terms, d.vector
        dx, dy = rates_of(tangent, d.vector)
        square = terms.let(there[0] ** 2 + there[1] ** 2)
        dk = terms.let(-square * terms.let(x * dx + y * dy) / (d.square**2 * k))
        moved = half * dx - k * dy - dk * y, half * dy + k * dx + dk * x
        return terms.let(cross(there, moved) / square)

    return loop


def rocker():
    """Return a mechanism of a crank and a rocker, connected by a rod of the rocker's length."""
    a, b, g = (Parameter(n, x) for n, x in (("a", "1/2"), ("b", "6/5"), ("g", "7/5")))
    return Mechanism(
        "rocker",
        (pin("crank", BASE, "input"), pin("lever", BASE, "output", g.symbol)),
        ("crank",),
        struts=(
            Strut("rod", Frame("input", at(a.symbol)), Frame("output", at(b.symbol)), b.symbol),
        ),
        tool_body="output",
        parameters=(a, b, g),
        reference=near(("crank", 1), ("lever", 2), ("rod_swing", "-1/2")),
    )


@pytest.fixture
def with_isosceles(monkeypatch):
    monkeypatch.setattr(assembly, "STEPS", (Isosceles, *assembly.STEPS))


FUNCTIONS = ["configuration", "chain", "chain_rates", "margin", "chain_all"]


def numbers():
    found = []
    for f in lower(derive(rocker(), functions=FUNCTIONS).functions, "test"):
        for q in np.linspace(-1.5, 1.5, 31):
            results = f.call([q, 0.7][: f.n_in()])
            found += [np.array(result).ravel() for result in results]
    return found


def test_added_step_matches_built_in_three_pins(request):
    (built_in,) = solved(rocker()).forward.steps
    assert type(built_in) is ThreePins
    expected = numbers()
    request.getfixturevalue("with_isosceles")
    (step,) = solved(rocker()).forward.steps
    assert type(step) is Isosceles
    assert (step.branch, step.sign) == (built_in.branch, built_in.sign)
    found = numbers()
    assert len(found) == 6 * 31
    for one, other in zip(found, expected, strict=True):
        assert np.isfinite(one).all()
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-12)


@pytest.mark.usefixtures("with_isosceles")
def test_loops_solved_by_added_step_close():
    model = Model(rocker())
    (configuration,) = lower(derive(rocker(), functions=["configuration"]).functions, "test")
    z = np.array([np.array(configuration(q)).ravel() for q in np.linspace(-1.5, 1.5, 31)])
    assert model.gap(z).max() < 1e-12


@pytest.mark.usefixtures("with_isosceles")
def test_article_prints_text_and_equations_of_added_step():
    found = fragments(derive(rocker()))
    assert r"\textbf{Step 1: an isosceles triangle}" in found["solution.tex"]
    assert r"k_{1} &= -\sqrt{\frac{b^{2}}{D_{1}^{2}} - 0.25}" in found["solution.tex"]
    assert "The far pin is above the middle of $D_{1}$, on its right." in found["solution.tex"]
    assert r"b^{2} \dot{\theta}_{1} &=" in found["rates.tex"]


@pytest.mark.usefixtures("with_isosceles")
def test_printed_rates_of_added_step_match_its_functions():
    h = solved(rocker())
    (step,) = h.forward.steps
    equations = step.equations()
    quantities = Numbers(h.forward, equations)
    tangent = Tangent(h.terms, {h.q[0]: HALF}, h.forward.loops)
    rates = [h.forward.reference.of(tangent.of(term)) for term in equations.vectors["D"]]
    moved = dict(zip(components("D"), rates, strict=True))
    for equation, angle in zip(equations.rates, step.solved, strict=True):
        right = sum(quantities(weight) * moved[part] for part, weight in equation.right)
        ((unknown, factor),) = equation.left
        assert unknown == angle
        found = right / quantities(factor)
        assert found == pytest.approx(h.forward.reference.of(tangent.of(angle)), abs=1e-12)


@pytest.mark.usefixtures("with_isosceles")
def test_unsuitable_added_step_falls_back_to_built_in_step():
    (step,) = solved(four_bar()).forward.steps
    assert type(step) is ThreePins
