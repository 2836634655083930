"""Factored determinants of Jacobians agree with numerical determinants."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

import chasles.derive
from chasles.derive.chain.singular.conditions import conditions, roots
from chasles.derive.chain.singular.determinant import determinant, factored_minors
from chasles.derive.chain.singular.factors import Factored
from chasles.derive.chain.singular.nearest import nearest_singular
from chasles.derive.chain.singular.singular_configurations import words
from chasles.derive.latex.chain.singularity_fragment import singularities
from chasles.derive.latex.setting.page import Page
from tests.support.generators.round_arms import round_arm
from tests.support.generators.synthetic import jacobian as of_screws
from tests.support.oracles.screws import screws_of

ROBOTS = Path(chasles.derive.__file__).parent / "robots"
SQUARE = ("ur5e", "irb6640", "stanford", "scara")
SEVERAL = ("iiwa14", "lynxmotion")
"""Names of arms with seven and five joints, whose Jacobians are not square and have several maximal
minors."""
TEN_DIGITS = 1e-10
CONFIGURATIONS = 100
LOST = 1e-8
"""Upper bound (m, rad) on the smallest singular value of a rank-deficient Jacobian. The roots of
the singularity conditions are accurate to 1e-9."""
FULL = 1e-4
"""Lower bound (m, rad) on the smallest singular value of a nonsingular Jacobian."""


@cache
def loaded(name):
    path = ROBOTS / f"{name}.toml"
    return chasles.derive.read(path if path.exists() else ROBOTS / "shelf" / f"{name}.toml")


def coordinates(robot):
    return sp.symbols(f"q1:{len(robot.moving) + 1}", real=True)


def in_numbers(robot, expression):
    """Convert a symbolic expression to a numerical function of the joint coordinates of a robot."""
    values = {parameter.symbol: parameter.value for parameter in robot.parameters}
    return sp.lambdify([list(coordinates(robot))], expression.xreplace(values), "numpy")


@cache
def minors(name):
    return factored_minors(loaded(name), coordinates(loaded(name)))


@cache
def found_conditions(name):
    """Return the singularity conditions of an arm."""
    robot = loaded(name)
    values = {parameter.symbol: parameter.value for parameter in robot.parameters}
    return conditions(minors(name), coordinates(robot), values)


@cache
def whole_determinant(name):
    return determinant(loaded(name), coordinates(loaded(name)))


def product(found):
    return sp.Mul(found.constant, *(factor**power for factor, power in found.factors))


def jacobian(robot):
    screws = screws_of(robot)
    return lambda q: of_screws(screws, np.asarray(q))


def volume(J):
    """Return the volume sqrt(det(J^T J)) of a Jacobian, which equals |det J| if J is square."""
    return np.sqrt(abs(np.linalg.det(J.T @ J)))


@pytest.mark.parametrize("name", SQUARE)
def test_factor_product_equals_jacobian_determinant(name):
    robot = loaded(name)
    q, J = coordinates(robot), jacobian(robot)
    found = in_numbers(robot, product(whole_determinant(name)))
    configurations = np.random.default_rng(5).uniform(-3, 3, (CONFIGURATIONS, len(q)))
    for configuration, at in zip(configurations, J(configurations), strict=True):
        expected = volume(at)
        assert abs(abs(found(configuration)) - expected) <= TEN_DIGITS * max(1.0, expected)


def test_ur5e_determinant_has_textbook_factors():
    q = coordinates(loaded("ur5e"))
    a2, a3, d5 = (sp.Symbol(name, real=True) for name in ("a2", "a3", "d5"))
    shoulder = a2 * sp.cos(q[1]) + a3 * sp.cos(q[1] + q[2]) + d5 * sp.sin(q[1] + q[2] + q[3])
    factors = {str(factor) for factor, power in whole_determinant("ur5e").factors if power == 1}
    assert factors == {str(shoulder), str(sp.sin(q[2])), str(sp.sin(q[4]))}


@pytest.mark.parametrize(
    ("name", "meanings"),
    [
        (
            "irb6640",
            {
                "the wrist center is on axis 1",
                "the wrist center is in the plane of axes 2 and 3; the arm is stretched or folded",
                "axes 4 and 6 coincide",
            },
        ),
        (
            "ur5e",
            {
                "the intersection of axes 5 and 6 is in the plane of axis 1 and the direction of"
                " axis 2",
                "axes 2, 3 and 4 lie in a plane; the arm is stretched or folded",
                "axes 4 and 6 are parallel",
            },
        ),
    ],
    ids=["irb6640", "ur5e"],
)
def test_explanation_describes_axis_geometry_of_each_factor(name, meanings):
    robot = loaded(name)
    q = coordinates(robot)
    assert {words(robot, q, (factor,)) for factor, _ in whole_determinant(name).factors} == meanings


def test_zero_of_wrist_factor_is_a_singular_configuration():
    robot = loaded("irb6640")
    q, J = coordinates(robot), jacobian(robot)
    wrist = next(f for f, _ in whole_determinant("irb6640").factors if f == sp.sin(q[4]))
    assert wrist == sp.sin(q[4])
    configuration = np.array([0.3, -0.4, 0.5, 0.6, 0.0, 0.7])
    assert np.linalg.svd(J(configuration))[1][-1] <= TEN_DIGITS
    configuration[4] = 0.2
    assert np.linalg.svd(J(configuration))[1][-1] > 1e-3


TURNED = """name = "arm"
convention = "dh"
joints = [
{{ d = "0.3", alpha = "{first}" }},
{{ a = "0.4" }},
{{ a = "0.1", alpha = "pi/2" }},
{{ d = "0.3", alpha = "{second}" }},
{{ alpha = "{third}" }},
{{ d = "0.1" }},
]
"""


@pytest.mark.parametrize("angles", ["pi/2 pi/4 -pi/6", "11*pi/36 pi/3 pi/2"])
def test_determinant_factors_with_arbitrary_exact_twist_angles(angles):
    first, second, third = angles.split()
    text = TURNED.format(first=first, second=second, third=third)
    robot = chasles.derive.read_text(text, file="arm.toml")
    q, J = coordinates(robot), jacobian(robot)
    made = determinant(robot, q)
    assert len(made.factors) >= 2
    found = in_numbers(robot, product(made))
    configurations = np.random.default_rng(6).uniform(-3, 3, (CONFIGURATIONS, len(q)))
    for configuration, at in zip(configurations, J(configurations), strict=True):
        expected = volume(at)
        assert abs(abs(found(configuration)) - expected) <= TEN_DIGITS


def test_iiwa14_has_four_textbook_singularity_conditions():
    robot = loaded("iiwa14")
    q = coordinates(robot)
    found = conditions(minors("iiwa14"), q, {})
    c, s = ([f(x) for x in q] for f in (sp.cos, sp.sin))
    textbook = {(s[3],), (s[1], c[2]), (s[5], c[4]), (s[1], s[5])}
    assert {frozenset(one) for one in found} == set(map(frozenset, textbook))


Q = sp.symbols("q2:5", real=True)
S2, S3, S4, S34, S234 = map(sp.sin, (*Q, Q[1] + Q[2], sum(Q)))
C2, C3, C4 = map(sp.cos, Q)


@pytest.mark.parametrize(
    ("products", "expected"),
    [
        ([S2 * C3 * C4 - C2 * S4, S2], {(S2, S4)}),
        ([S234, S2, S34], {(S2, S34)}),
        ([1 + C2, S2], {(1 + C2,)}),
        ([S2 * C3 - C2 * S3 * C4, S2], {(S2, S3), (C4, S2)}),
        ([2 * S3 - C2 * C3, S2], {(S2, 2 * S3 - C2 * C3)}),
    ],
)
def test_conditions_contain_no_factor_that_the_others_imply(products, expected):
    """Each expression in `products` is one minor of the Jacobian."""
    found = conditions([Factored(sp.S.One, ((one, 1),)) for one in products], Q, {})
    assert set(map(frozenset, found)) == set(map(frozenset, expected))


def test_factors_have_no_common_irrational_factor():
    """The elbow factor of the arm is sqrt(2) cos(q - pi/4), a cosine plus a sine."""
    rows = ("a = '0.3', alpha = 90, d = '0.3'", "a = '0.4'", "a = '0.3', alpha = 90")
    wrist = ("d = '0.3', alpha = -90", "alpha = 90", "d = '0.1'")
    joints = ", ".join(f"{{ name = 'j{k}', {row} }}" for k, row in enumerate((*rows, *wrist)))
    units = 'units = { length = "m", angle = "deg" }'
    robot = chasles.derive.read_text(f'name = "a"\nconvention = "dh"\n{units}\njoints = [{joints}]')
    (found,) = factored_minors(robot, coordinates(robot))
    elbow = [factor for factor, _ in found.factors if factor.has(sp.pi) and not factor.is_Add]
    assert [type(factor) for factor in elbow] in ([sp.cos], [sp.sin])
    determinant = in_numbers(robot, product(found))
    for q in np.random.default_rng(3).uniform(-3, 3, (5, 6)):
        assert abs(determinant(q)) == pytest.approx(volume(jacobian(robot)(q)), abs=1e-10)


def on_conditions(robot, found):
    """Yield random configurations that satisfy one of a robot's singularity conditions."""
    q = coordinates(robot)
    values = {parameter.symbol: parameter.value for parameter in robot.parameters}
    for condition in found:
        yield from roots([factor.xreplace(values) for factor in condition], q, CONFIGURATIONS // 8)


@pytest.mark.parametrize("name", [*SEVERAL, *SQUARE[:2], "crx10ia"])
def test_jacobian_loses_rank_only_on_singularity_conditions(name):
    robot = loaded(name)
    q, J = coordinates(robot), jacobian(robot)
    found = found_conditions(name)
    least = np.linalg.svd(J([*on_conditions(robot, found)]))[1][:, -1]
    assert len(least) >= len(found) * 10
    assert max(least) <= LOST
    drawn = np.random.default_rng(7).uniform(-3, 3, (CONFIGURATIONS, len(q)))
    assert np.linalg.svd(J(drawn))[1][:, -1].min() > FULL / 10


@pytest.mark.parametrize("name", SEVERAL)
def test_numerically_found_singularities_satisfy_a_condition(name):
    """Singular configurations found by Newton's method satisfy a derived condition."""
    robot = loaded(name)
    q = coordinates(robot)
    found = found_conditions(name)
    made = [in_numbers(robot, sp.Matrix(condition)) for condition in found]
    configurations = nearest_singular(robot, [0.3] * len(q), 8)
    assert len(configurations) >= 4
    for configuration in configurations:
        assert min(np.abs(one(configuration)).max() for one in made) <= 1e-6


def test_arm_without_short_factors_prints_singular_configurations():
    robot = loaded("jaco2")
    printed = Page.of(chasles.derive.derive(robot, functions=["fk"])).singular
    assert not printed.conditions
    J = jacobian(robot)
    assert len(printed.configurations) == 4
    for configuration in printed.configurations:
        shown = np.round(configuration, 7)
        assert np.linalg.svd(J(shown))[1][-1] <= 1e-6
    drawn = np.random.default_rng(8).uniform(-3, 3, (20, len(robot.moving)))
    assert min(np.linalg.svd(J(q))[1][-1] for q in drawn) > FULL


@pytest.mark.parametrize("name", ["panda"])
def test_determinant_with_last_joint_fixed_matches_six_columns(name):
    """The expected value is the determinant of the Jacobian columns of the six free joints."""
    robot = loaded(name)
    page = Page.of(chasles.derive.derive(robot, functions=["ik"]))
    found, notation = page.singular, page.equations.notation
    assert found.fixed == (notation.q[6],)
    constant, factors = found.determinant
    assert len(factors) == 4
    whole = sp.Mul(constant, *(factor**power for factor, power in factors))
    while whole.free_symbols & notation.meanings.keys():
        whole = whole.xreplace(notation.meanings)
    own = dict(zip(notation.q, coordinates(robot), strict=True))
    value, J = in_numbers(robot, whole.xreplace(own)), jacobian(robot)
    configurations = np.random.default_rng(7).uniform(-3, 3, (CONFIGURATIONS, 7))
    for q, at in zip(configurations, J(configurations), strict=True):
        assert abs(value(q)) == pytest.approx(volume(at[:, :6]), abs=TEN_DIGITS)
    assert len(found.conditions) == len(factors)


RANK_LOST = (94048, 94092, 94138)
"""Seeds of random arms with two, three and five joints that are singular in every configuration."""
FULL_RANK = (94007, 94008)
"""Seeds of random arms with two and three joints whose Jacobians have full rank."""


@pytest.mark.parametrize("seed", RANK_LOST)
def test_page_states_rank_of_arms_singular_in_every_configuration(seed):
    robot = chasles.derive.read_text(round_arm(seed), file="arm.toml")
    page = Page.of(chasles.derive.derive(robot, functions=["fk"]))
    q, J = coordinates(robot), jacobian(robot)
    drawn = np.random.default_rng(9).uniform(-3, 3, (20, len(q)))
    ranks = {np.linalg.matrix_rank(J(configuration), FULL) for configuration in drawn}
    assert ranks == {page.singular.rank}
    assert page.singular.rank < len(q)
    said = singularities(page)
    assert f"rank of the Jacobian is ${page.singular.rank}$ at most" in said
    assert f"its {len(q)} columns" in said


@pytest.mark.parametrize("seed", FULL_RANK)
def test_full_rank_arms_get_no_rank_statement(seed):
    robot = chasles.derive.read_text(round_arm(seed), file="arm.toml")
    J = jacobian(robot)
    configuration = np.random.default_rng(9).uniform(-3, 3, len(robot.moving))
    page = Page.of(chasles.derive.derive(robot, functions=["fk"]))
    assert np.linalg.matrix_rank(J(configuration), FULL) == len(robot.moving)
    assert page.singular.rank is None
    assert "at most" not in singularities(page)


MILL = """
name = "mill"
convention = "urdf"
units = { length = "mm", angle = "deg" }
"""


def test_a_mill_is_nowhere_singular():
    """The mill has three perpendicular prismatic and two perpendicular revolute joints."""
    axes = ([1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 1, 0], [0, 0, 1])
    kinds = ["prismatic"] * 3 + ["revolute"] * 2
    joints = [
        f'[[joints]]\nname = "j{k}"\ntype = "{kind}"\naxis = {axis}\nxyz = [30, {10 * k}, 0]\n'
        for k, (kind, axis) in enumerate(zip(kinds, axes, strict=True))
    ]
    robot = chasles.derive.read_text(MILL + "".join(joints), file="mill.toml")
    page = Page.of(chasles.derive.derive(robot, functions=["fk"]))
    assert page.singular.is_regular
    assert "the robot has no singularity" in singularities(page)
    J = jacobian(robot)
    configurations = np.random.default_rng(0).choice([0, np.pi / 2, np.pi, 1.0], (50, 5))
    assert np.linalg.svd(J(configurations), compute_uv=False).min() > 0.1


def test_singularity_text_numbers_axes_of_the_whole_arm():
    page = Page.of(chasles.derive.derive(loaded("photo_robot"), functions=["ik"]))
    assert [k for k, q in enumerate(page.equations.notation.q) if q in page.singular.fixed] == [
        0,
        3,
    ]
    # Joints 1 and 4 are fixed. The first revolute joint is axis 2, and the wrist is axes 6, 7 and
    # 8.
    assert {condition.words for condition in page.singular.conditions} == {
        "the wrist center is on axis 2",
        "the wrist center is in the plane of axes 3 and 5; the arm is stretched or folded",
        "axes 6 and 8 coincide",
    }


def test_conditions_of_arm_without_spherical_wrist_are_singular():
    """The wrist axes do not intersect, and the length d7 occurs only in the tool frame."""
    text = (Path(chasles.derive.__file__).parent / "robots" / "iiwa14.toml").read_text()
    turned = 'd = "d5"\nalpha = -90\n'
    assert turned in text
    robot = chasles.derive.read_text(text.replace(turned, 'd = "d5"\n'))
    said = singularities(Page.of(chasles.derive.derive(robot, functions=["fk"])))
    J = jacobian(robot)
    lost = {"c_{56}": (5, np.pi / 2 - 0.4), "s_{2}": (1, 0.0), "s_{4}": (3, 0.0)}
    for condition, (joint, value) in lost.items():
        assert f"${condition} = 0$" in said
        q = np.array([0.3, 0.9, -0.5, 1.1, 0.4, 0.8, 0.2])
        q[joint] = value
        assert np.linalg.matrix_rank(J(q), FULL) == 5


def test_arm_with_pi_in_a_length_before_a_prismatic_joint_has_numeric_singularities():
    robot = chasles.derive.read_text(
        'name = "column"\nconvention = "mdh5"\n[[joints]]\na = 0.3\nc = "pi/2"\n'
        '[[joints]]\ntype = "prismatic"\na = 0.2\nc = "pi/2"\n[[joints]]\na = 0.1\n'
    )
    assert factored_minors(robot, coordinates(robot)) is None
    found = Page.of(chasles.derive.derive(robot, functions=["fk"])).singular
    J = jacobian(robot)
    assert found.rank is None
    for q in found.configurations:
        assert np.linalg.matrix_rank(J(np.array(q)), LOST) == 2
