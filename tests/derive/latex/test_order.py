"""Names in generated output do not depend on the order of functions, terms or symbols."""

import random
from itertools import permutations

import pytest

from chasles.derive import derive, read
from chasles.derive.chain.coordinates import InProportion
from chasles.derive.chain.groups import groups
from chasles.derive.chain.kinematics import FUNCTIONS, Kinematics, arguments_of
from chasles.derive.latex import equations, fragments
from chasles.derive.latex.chain.example_fragment import worked_example
from chasles.derive.latex.chain.functions_fragment import forward_kinematics, jacobians
from chasles.derive.latex.chain.geometry_fragment import link_transforms, screws
from chasles.derive.latex.chain.given_fragment import parameters, symbols
from chasles.derive.latex.chain.singularity_fragment import singularities
from chasles.derive.latex.inverse.inverse_fragment import inverse
from chasles.derive.latex.references import references
from chasles.derive.latex.setting.page import Page
from chasles.derive.terms.terms import Terms
from tests.support.derivations import ROBOTS as FOLDER
from tests.support.derivations import derivation
from tests.support.printed_robots import calibrated, derived

WRITERS = {
    "parameters.tex": parameters,
    "screws.tex": screws,
    "transforms.tex": link_transforms,
    "fk.tex": forward_kinematics,
    "jacobian.tex": jacobians,
    "inverse.tex": inverse,
    "singularities.tex": singularities,
    "example.tex": worked_example,
}


def message(function):
    """Return the name, outputs, ordered definitions and margin of a function."""
    return function.name, function.outputs, function.definitions(), function.margin


@pytest.mark.parametrize("name", ["jaco2", "scara", "awkward"])
def test_fragments_written_in_any_order_are_the_same(name):
    found = derived(name)
    if found.robot.couplings:
        found = derive(found.robot.uncoupled)
    expected = dict(fragments(found))
    # The pictures in a LaTeX article depend only on the robot description.
    for picture in ("drawing.tex", "workspace.tex"):
        expected.pop(picture, None)
    names = list(WRITERS)
    random.Random(name).shuffle(names)
    page = Page.of(found)
    written = {file: WRITERS[file](page) for file in names}
    # The symbol table lists the symbols of all other LaTeX fragments.
    written["symbols.tex"] = symbols(page)
    written["references.tex"] = references(written.values())
    assert {file: text for file, text in written.items() if text} == expected, names


def test_an_article_is_the_same_when_it_is_written_again():
    found = derive(read(FOLDER / "four_bar.toml"))
    assert fragments(found) == fragments(found)


@pytest.mark.parametrize("name", ["scara", "four_bar", "planar_3rrr"])
def test_functions_are_independent_of_request_order(name):
    robot = read(FOLDER / f"{name}.toml")
    whole = derivation(name)
    expected = [message(function) for function in whole.functions]
    names = [function.name for function in (*whole.functions, *whole.written)]
    random.Random(name).shuffle(names)
    assert [message(function) for function in derive(robot, functions=names).functions] == expected


def test_term_names_are_independent_of_request_order():
    def named(names):
        robot = read(FOLDER / "ur5e.toml")
        terms = Terms({p.symbol: p.value for p in robot.parameters})
        arguments = arguments_of([joint.unit for joint in robot.coordinates])
        motion = InProportion(robot, terms, arguments["q"].symbols)
        chain = groups(robot, terms, motion.values)
        made = Kinematics.of(robot, terms, chain, motion, arguments).functions(names)
        assert list(made) == [name for name in FUNCTIONS if name in names]
        return {name: message(function) for name, function in made.items()}

    asked = ("fk", "jacobian_space", "jacobian_mixed_dot", "hessian_mixed")
    expected = named(asked)
    for order in [*permutations(asked)][3::4]:
        assert named(order) == expected


def test_printed_names_are_independent_of_other_functions():
    robot = calibrated()
    expected = equations(derived("calibrated"))
    for names in (["fk"], ["jacobian_mixed"], ["jacobian_space", "jacobian_mixed", "fk"]):
        found = equations(derive(robot, functions=names))
        assert found.fk == expected.fk
        assert found.jacobian_mixed == expected.jacobian_mixed
        assert found.jacobian_space == expected.jacobian_space


def test_writing_an_article_leaves_derivation_terms_unchanged():
    found = derive(read(FOLDER / "scara.toml"))
    before = dict(found.terms.definitions), dict(found.terms.constants)
    fragments(found)
    assert (found.terms.definitions, found.terms.constants) == before
