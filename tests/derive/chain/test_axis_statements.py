"""Check geometric singularity conditions of LaTeX articles at random singular configurations."""

from pathlib import Path

import numpy as np
import pytest

import chasles.derive
from chasles.derive.chain.singular.conditions import roots
from chasles.derive.latex.loops.loop_page import LoopPage
from chasles.derive.latex.setting.page import Page
from chasles.derive.model.mechanism import Mechanism
from tests.support.generators.round_arms import round_arm
from tests.support.generators.synthetic import jacobian
from tests.support.oracles.axis_statements import Arm, deviation
from tests.support.oracles.screws import screws_of

ROBOTS = Path(chasles.derive.__file__).parent / "robots"
STATEMENTS = {
    "excavator": 1,
    "iiwa14": 4,
    "lynxmotion": 2,
    "panda": 2,
    "photo_robot": 3,
    "scara": 1,
    "stanford": 3,
    "ur5e": 3,
    "arm65": 2,
    "arm99": 1,
}
"""Number of statements about joint axes in the LaTeX article of each shipped robot or random arm.

Together, the LaTeX articles of these robots contain every kind of statement about joint axes. Some
of the robots have loops, fixed joints or prismatic joints."""
CONFIGURATIONS = 30
HOLDS = 1e-6
"""Tolerance of statements about joint axes, for the sine of an angle or a distance divided by the
arm length."""
LOST = 1e-7
"""Upper bound (m, rad) on the smallest singular value of a rank-deficient Jacobian."""


def page_of(name):
    if name.startswith("arm"):
        seed = int(name.removeprefix("arm"))
        robot = chasles.derive.read_text(round_arm(seed), file="arm.toml")
    else:
        robot = chasles.derive.read(ROBOTS / f"{name}.toml")
    if isinstance(robot, Mechanism):
        return LoopPage.of(chasles.derive.derive(robot, functions=["fk"])).chain
    return Page.of(chasles.derive.derive(robot, functions=["fk"]))


@pytest.mark.parametrize("name", STATEMENTS)
def test_statements_about_axes_hold_at_random_singular_configurations(name):
    page = page_of(name)
    found, notation = page.singular, page.equations.notation
    values = {parameter.symbol: parameter.value for parameter in page.robot.parameters}
    screws, q = screws_of(page.robot), list(notation.q)
    free = [k for k, symbol in enumerate(q) if symbol not in found.fixed]
    stated = [condition for condition in found.conditions if condition.words]
    assert len(stated) == STATEMENTS[name]
    assert not found.is_regular
    for condition in stated:
        factors = list(condition.factors)
        while set().union(*(f.free_symbols for f in factors)) & notation.meanings.keys():
            factors = [factor.xreplace(notation.meanings) for factor in factors]
        configurations = list(roots([f.xreplace(values) for f in factors], q, CONFIGURATIONS))
        assert configurations
        for configuration in configurations:
            assert deviation(condition.words, Arm(screws, configuration)) <= HOLDS
            columns = jacobian(screws, configuration)[:, free]
            assert np.linalg.svd(columns)[1][-1] <= LOST
