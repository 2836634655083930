"""The formulas of screw axes and joint exponentials are exact, short and never degenerate."""

import pytest
from sympy import Float, Rational, cos, count_ops, diff, eye, oo, pi, sin, sqrt, symbols, zeros

from . import lie
from .oracles import assert_close, expm, vector

q, a, b, h = symbols("q a b h", real=True)
Z = lie.Matrix([0, 0, 1])
DIAGONAL = lie.Matrix([1, 1, 0]) / sqrt(2)
ORIGIN = zeros(3, 1)
AXES = [Z, -Z, DIAGONAL, lie.Matrix([2, -3, 6]) / 7]
PITCHES = [0, Rational(1, 5), -3, oo]


def test_screw_axis_is_a_unit_twist_through_the_point() -> None:
    point = lie.Matrix([a, b, 2])
    checked = 0
    for axis in AXES:
        for pitch in PITCHES[:3]:
            screw = lie.screw_axis(axis, point, pitch)
            v, omega = screw[:3, :], screw[3:, :]
            assert omega == axis
            assert (v + omega.cross(point) - pitch * axis).expand() == zeros(3, 1)
            assert omega.dot(v).expand() == pitch
            checked += 1
    assert checked == 12
    assert lie.screw_axis(DIAGONAL, point, oo) == lie.Matrix([*DIAGONAL, 0, 0, 0])


def test_exp_of_revolute_screw_about_z_matches_its_matrix() -> None:
    T = lie.exp_screw(lie.screw_axis(Z, lie.Matrix([a, 0, b])), q)
    assert (
        lie.Matrix(
            [
                [cos(q), -sin(q), 0, a * (1 - cos(q))],
                [sin(q), cos(q), 0, -a * sin(q)],
                [0, 0, 1, 0],
                [0, 0, 0, 1],
            ]
        )
        == T
    )


def test_exp_of_prismatic_and_helical_screws_is_exact() -> None:
    assert lie.exp_screw(lie.screw_axis(DIAGONAL, ORIGIN, oo), q) == lie.pose(eye(3), q * DIAGONAL)
    T = lie.exp_screw(lie.screw_axis(Z, ORIGIN, h), q)
    assert lie.translation(T) == lie.Matrix([0, 0, h * q])
    assert lie.rotation(T) == lie.Matrix([[cos(q), -sin(q), 0], [sin(q), cos(q), 0], [0, 0, 1]])


def test_rotation_about_diagonal_axis_is_exact() -> None:
    R = lie.rotation(lie.exp_screw(lie.screw_axis(DIAGONAL, ORIGIN), q))
    c, s = cos(q), sin(q) / sqrt(2)
    expected = [[(1 + c) / 2, (1 - c) / 2, s], [(1 - c) / 2, (1 + c) / 2, -s], [-s, s, c]]
    assert (R - lie.Matrix(expected)).expand() == zeros(3, 3)


def test_exp_screw_has_few_operations() -> None:
    """Terms that cancel would increase the operation count."""
    point = lie.Matrix([a, b, 0])
    assert count_ops(lie.exp_screw(lie.screw_axis(Z, ORIGIN), q)) <= 5
    assert count_ops(lie.exp_screw(lie.screw_axis(Z, point), q)) <= 19
    assert count_ops(lie.exp_screw(lie.screw_axis(lie.Matrix([1, 0, 0]), ORIGIN), q)) <= 5
    assert count_ops(lie.exp_screw(lie.screw_axis(DIAGONAL, point), q)) <= 62
    # If the pitch is zero, the joint variable q occurs only in sin and cos. The scalar product
    # omega.v is zero only after expansion.
    checked = 0
    for axis in AXES:
        T = lie.exp_screw(lie.screw_axis(axis, lie.Matrix([a + b, a - b, 3])), q)
        assert not T.subs({cos(q): 1, sin(q): 0}).has(q)
        checked += 1
    assert checked == 4


def test_exp_screw_is_a_one_parameter_group() -> None:
    """For a screw S, exp(S q) exp(S a) = exp(S (q + a)), and the derivative at zero is the
    screw."""
    checked = 0
    for axis in AXES:
        for pitch in PITCHES:
            screw = lie.screw_axis(axis, lie.Matrix([1, b, -2]), pitch)
            T = lie.exp_screw(screw, q)
            product = T * lie.exp_screw(screw, a)
            total = lie.exp_screw(screw, q + a).applyfunc(lambda e: e.expand(trig=True))
            assert (product - total).expand() == zeros(4, 4)
            assert diff(T, q).subs(q, 0).expand() == lie.hat_se3(screw).expand()
            assert (diff(T, q) - lie.hat_se3(screw) * T).expand().subs(
                sin(q) ** 2, 1 - cos(q) ** 2
            ).expand() == zeros(4, 4)
            checked += 1
    assert checked == 16


def test_exp_screw_agrees_with_exp_se3_and_expm() -> None:
    checked = 0
    for axis in AXES:
        for pitch in PITCHES:
            screw = lie.screw_axis(axis, lie.Matrix([Rational(1, 3), -1, 2]), pitch)
            for angle in (0.0, 1e-8, 0.7, 3.14159265, 6.0):
                T = lie.exp_screw(screw, Float(angle))
                x = (screw * Float(angle)).n()
                assert_close(T.n(), expm(lie.hat_se3(x)), (axis, pitch, angle))
                assert_close(T.n(), lie.exp_se3(x), (axis, pitch, angle))
                checked += 1
    assert checked == 80


def test_exp_screw_is_exact_at_exact_angles() -> None:
    screw = lie.screw_axis(DIAGONAL, lie.Matrix([1, 0, 0]))
    half = lie.exp_screw(screw, pi)
    assert half == lie.Matrix([[0, 1, 0, 1], [1, 0, 0, -1], [0, 0, -1, 0], [0, 0, 0, 1]])
    assert lie.exp_screw(screw, 2 * pi) == eye(4)
    assert lie.exp_screw(screw, 0) == eye(4)


def test_exp_screw_of_symbolic_unit_axis_matches_exp_so3() -> None:
    axis = lie.Matrix([sin(a), 0, cos(a)])
    T = lie.exp_screw(lie.screw_axis(axis, ORIGIN), q)
    at = T.subs({a: pi / 6, q: pi / 2})
    assert at[:3, :3] == lie.exp_so3(pi / 2 * axis.subs(a, pi / 6))


@pytest.mark.parametrize(
    "direction",
    [lie.Matrix([1, 1, 0]), vector(1.0, 1e-5, 0.0), ORIGIN],
    ids=["length sqrt(2)", "length 1+5e-11", "zero"],
)
def test_direction_that_is_not_a_unit_vector_is_rejected(direction: lie.Matrix) -> None:
    with pytest.raises(ValueError, match=r"direction is .* of length .*: expected a unit vector"):
        lie.screw_axis(direction, ORIGIN)
    if direction != ORIGIN:
        with pytest.raises(ValueError, match=r"omega of the screw is .*: expected a unit vector"):
            lie.exp_screw(lie.Matrix.vstack(ORIGIN, direction), q)


def test_a_unit_direction_in_floats_is_accepted() -> None:
    direction = vector(0.6, 0.8 + 1e-14, 0.0)
    assert_close(lie.screw_axis(direction, ORIGIN)[3:, :], direction)
