"""Tests every C operation on all kinds of numbers, in scalar and vector code."""

import ctypes
import itertools
import re
import shutil
import subprocess
from functools import cache
from pathlib import Path

import mpmath
import numpy as np
import pytest
import sympy as sp

from chasles.derive.derivation import Derivation
from chasles.derive.emit.c import language
from chasles.derive.program.programs import programs
from chasles.derive.terms.casadi_graph import LoweringError, lower
from chasles.derive.terms.symbolic_function import Argument, Result, SymbolicFunction
from chasles.derive.terms.terms import Terms
from tests.support.derivations import robot_of
from tests.support.processor import require_features
from tests.support.tolerances import ANGLE, COS_SIN, LIBMVEC
from tests.support.tools import needs, path_of

GCC = shutil.which("gcc")
pytestmark = [
    needs("gcc"),
    pytest.mark.filterwarnings("ignore::RuntimeWarning"),
]

x, y = sp.symbols("x y", real=True)


def c_sign(a):
    return np.where((a < 0) | (a > 0), np.sign(a), a)


CASES = {
    "sum": (x + y, lambda a, b: a + b),
    "negative": (-x, lambda a, b: -a),
    "product": (x * y, lambda a, b: a * b),
    "quotient": (x / y, lambda a, b: a / b),
    "inverse": (1 / x, lambda a, b: 1 / a),
    "root": (sp.sqrt(x), lambda a, b: np.sqrt(a)),
    "inverse_root": (1 / sp.sqrt(x), lambda a, b: 1 / np.sqrt(a)),
    "over_root": (x / sp.sqrt(y), lambda a, b: a / np.sqrt(b)),
    "three_halves": (sp.sqrt(x) ** 3, lambda a, b: np.sqrt(a) * a),
    "norm": (sp.sqrt(x**2 + 3), lambda a, b: np.sqrt(a * a + 3)),
    "absolute": (sp.Abs(x), lambda a, b: np.abs(a)),
    "root_of_square": (sp.sqrt(x**2), lambda a, b: np.abs(a)),
    "sign": (sp.sign(x), lambda a, b: c_sign(a)),
    "least": (sp.Min(x, y), np.fmin),
    "greatest": (sp.Max(x, y), np.fmax),
    "clipped": (sp.Max(-1, sp.Min(1, x)), lambda a, b: np.fmax(-1.0, np.fmin(1.0, a))),
    "least_of_three": (sp.Min(x, y, 2), lambda a, b: np.fmin(np.fmin(2.0, a), b)),
    "less": (sp.Piecewise((1, x < y), (0, True)), lambda a, b: 1.0 * (a < b)),
    "at_most": (sp.Piecewise((1, x <= y), (0, True)), lambda a, b: 1.0 * (a <= b)),
    "more": (sp.Piecewise((1, x > y), (0, True)), lambda a, b: 1.0 * (a > b)),
    "at_least": (sp.Piecewise((1, x >= 0), (0, True)), lambda a, b: 1.0 * (a >= 0)),
    "equal": (sp.Piecewise((1, sp.Eq(x, y)), (0, True)), lambda a, b: 1.0 * (a == b)),
    "unequal": (sp.Piecewise((1, sp.Ne(x, y)), (0, True)), lambda a, b: 1.0 * (a != b)),
    "both": (
        sp.Piecewise((x, (x > 0) & (y > 0)), (y, True)),
        lambda a, b: np.where((a > 0) & (b > 0), a, b),
    ),
    "either": (
        sp.Piecewise((x, (x > 0) | (y > 0)), (y, True)),
        lambda a, b: np.where((a > 0) | (b > 0), a, b),
    ),
    "not_both": (
        sp.Piecewise((x, ~((x > 0) & (y > 0))), (y, True)),
        lambda a, b: np.where(~((a > 0) & (b > 0)), a, b),
    ),
    "root_where_real": (
        sp.Piecewise((sp.sqrt(x), x >= 0), (-1, True)),
        lambda a, b: np.where(a >= 0, np.sqrt(a), -1.0),
    ),
    "guarded_quotient": (
        sp.Piecewise((x / y, sp.Abs(y) > sp.Rational(1, 8)), (0, True)),
        lambda a, b: np.where(np.abs(b) > 0.125, a / b, 0.0),
    ),
    "three_ways": (
        sp.Piecewise((1 / x, x > 1), (sp.sqrt(y), y > 1), (y, True)),
        lambda a, b: np.where(a > 1, 1 / a, np.where(b > 1, np.sqrt(b), b)),
    ),
    "sine": (sp.sin(x), lambda a, b: np.sin(a)),
    "cosine": (sp.cos(x), lambda a, b: np.cos(a)),
    "tan": (sp.tan(x), lambda a, b: np.tan(a)),
    "atan": (sp.atan(x), lambda a, b: np.arctan(a)),
    "atan2": (sp.atan2(y, x), lambda a, b: np.arctan2(b, a)),
    "atan2_of_number": (sp.atan2(-2, x), lambda a, b: np.arctan2(-2.0, a)),
}
EXTREMES = {"least", "greatest", "clipped", "least_of_three"}
"""Operations for which C does not define which of 0 and -0 is smaller."""
BY_LIBRARY = {"sine", "cosine", "tan", "atan", "atan2", "atan2_of_number"}

EDGES = [0.0, 5e-324, 1e-310, 2.2e-308, 1e-160, 1e-8, 0.125, 0.5, 1.0, 2.0, 1e8, 1e160, 1.7e308]
NUMBERS = [*EDGES, np.inf, *(-number for number in (*EDGES, np.inf)), np.nan]
LENGTHS = (1, 2, 3, 4, 5, 7, 8, 9, 15, 16, 17)

SUPPORTS = "-D__builtin_cpu_supports(x)="
SETS = {
    "avx512": [f"{SUPPORTS}1"],
    "avx2": [f'{SUPPORTS}(!__builtin_strstr(x, "avx512"))'],
    "baseline": [f"{SUPPORTS}0"],
}
NEEDED = {"avx512": {"avx512f", "avx512dq", "avx512vl"}, "avx2": {"avx2", "fma"}, "baseline": set()}
OLD_GLIBC = "#include <features.h>\n#undef __GLIBC_PREREQ\n#define __GLIBC_PREREQ(a, b) 0\n"


def function(name, *expressions):
    arguments = [Argument(str(s), (s,), (1,), "1", "a number") for s in (x, y)]
    results = [
        Result(f"value{k}", (expression,), (1,), "1", "a number")
        for k, expression in enumerate(expressions)
    ]
    return SymbolicFunction(name, "A case.", "", tuple(arguments), tuple(results), SCOPE)


SCOPE = Terms({})
ROBOT = robot_of("scara")
FUNCTIONS = [function(name, expression) for name, (expression, _) in CASES.items()]
FUNCTIONS.append(function("turn", sp.cos(x), sp.sin(x)))


@pytest.fixture(scope="module")
def sources(tmp_path_factory):
    folder = tmp_path_factory.mktemp("elementary")
    derived = Derivation(ROBOT, SCOPE, (), tuple(FUNCTIONS))
    files = {
        **language.files(derived, programs(FUNCTIONS, ROBOT.name)),
        "old_glibc.h": OLD_GLIBC,
    }
    for name, text in files.items():
        (folder / name).write_text(text)
    return folder


def compiled(folder, chosen_set, *flags, program=(GCC,)):
    """Compile the generated code for one instruction set.

    The compiler does not fuse operations, so that results of all instruction sets are comparable.
    """
    require_processor(chosen_set)
    target = folder / f"{chosen_set}{len(flags)}{Path(program[0]).name}.so"
    if target.exists():
        return ctypes.CDLL(str(target))
    command = [
        *(*program, "-O1", "-fno-math-errno", "-fno-trapping-math", "-ffp-contract=off"),
        *("-Wall", "-Wextra", "-Werror", "-Wno-psabi", "-shared", "-fPIC", *SETS[chosen_set]),
        *(*flags, f"{ROBOT.name}.c", f"{ROBOT.name}_batch.c", "-o", str(target), "-lm"),
    ]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[:2000]
    return ctypes.CDLL(str(target))


def require_processor(chosen_set):
    require_features(NEEDED[chosen_set])


@pytest.fixture(scope="module")
def numbers():
    """Return all pairs of edge cases, and random numbers of all magnitudes."""
    pairs = np.array(list(itertools.product(NUMBERS, NUMBERS))).T
    rng = np.random.default_rng(7)
    sizes = 10.0 ** rng.uniform(-5, 5, (2, 100))
    return np.hstack([pairs, rng.uniform(-1, 1, (2, 100)) * sizes])


@pytest.fixture(scope="module")
def scalar(sources, numbers):
    """Return a function that applies an operation to all test numbers by single calls.

    Results of single calls do not depend on the instruction set.
    """
    library = compiled(sources, "baseline")
    return cache(lambda name: single(library, name, *numbers))


def pointer(array):
    return array.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


def single(library, name, a, b):
    """Call a scalar C function once per pair of numbers (a, b), and return all results."""
    call = library[f"{ROBOT.name}_{name}"]
    values = np.empty_like(a)
    arrays = [
        (ctypes.c_double * len(a)).from_buffer(array) for array in (a.copy(), b.copy(), values)
    ]
    for at in range(0, values.nbytes, values.itemsize):
        call(*(ctypes.byref(array, at) for array in arrays))
    return values


def batch(library, name, a, b):
    a, b, values = a.copy(), b.copy(), np.full(len(a) + 1, -77.0)
    call = library[f"{ROBOT.name}_{name}_batch"]
    call(ctypes.c_size_t(len(a)), pointer(a), pointer(b), pointer(values))
    assert values[-1] == -77.0
    return values[:-1]


def assert_same(got, expected):
    """Assert that two arrays have equal bits.

    All NaN values count as equal.
    """
    np.testing.assert_array_equal(got, expected)
    there = ~np.isnan(expected)
    np.testing.assert_array_equal(np.signbit(got[there]), np.signbit(expected[there]))


def assert_alike(name, got, expected):
    if name in BY_LIBRARY:
        assert_near(got, expected)
    elif name in EXTREMES:
        assert_same(got + 0.0, expected + 0.0)
    else:
        assert_same(got, expected)


def assert_near(got, expected):
    """Assert the accuracy that libmvec documents, and equal signs of zeros."""
    finite = np.isfinite(expected) & (expected != 0)
    assert_same(got[~finite], expected[~finite])
    units = np.abs(got[finite] - expected[finite]) / np.spacing(np.abs(expected[finite]))
    assert units.max() <= LIBMVEC


def test_scalar_operations_match_numpy(scalar, numbers):
    for name, (_, meaning) in CASES.items():
        print(name)
        assert_alike(name, scalar(name), meaning(*numbers))


@pytest.mark.parametrize("chosen_set", SETS)
def test_vector_operations_match_scalar_operations(chosen_set, sources, scalar, numbers):
    library = compiled(sources, chosen_set)
    for name in CASES:
        print(name)
        expected = scalar(name)
        got = batch(library, name, *numbers)
        assert_alike(name, got, expected)
        for n in LENGTHS[1:]:
            for start in (0, 301):
                part = slice(start, start + n)
                assert_same(batch(library, name, *numbers[:, part]), got[part])
        assert_same(batch(library, name, *numbers[:, :1]), expected[:1])


def test_old_libmvec_falls_back_to_libm(sources, scalar, numbers):
    library = compiled(sources, "baseline", "-include", "old_glibc.h")
    listing = subprocess.run(
        ["nm", "-D", library._name], capture_output=True, text=True, check=True
    )
    assert re.search(r"\btan\b", listing.stdout)
    assert set(re.findall(r"_ZGV\w+?_(\w+)", listing.stdout)) == {"cos", "sin"}
    assert_same(batch(library, "tan", *numbers), scalar("tan"))


def turn(library, angles):
    angles = angles.copy()
    c, s = np.empty_like(angles), np.empty_like(angles)
    call = library[f"{ROBOT.name}_turn_batch"]
    call(ctypes.c_size_t(len(angles)), *map(pointer, (angles, angles, c, s)))
    return c, s


def near_right_angles(largest):
    """Return multiples of a right angle, and doubles next to these multiples."""
    multiples = np.unique(np.geomspace(1, largest, 250).astype(int)) * (np.pi / 2)
    return np.hstack([np.nextafter(multiples, 0), multiples, -np.nextafter(multiples, np.inf)])


def units_off(got, exact):
    with mpmath.workdps(50):
        return max(
            float(abs(mpmath.mpf(g) - e) / mpmath.mpf(float(np.spacing(abs(float(e))))))
            for g, e in zip(got.tolist(), exact, strict=True)
        )


ANGLES = {
    "one turn": (np.random.default_rng(1).uniform(-6.3, 6.3, 800), COS_SIN),
    "right angles": (near_right_angles(60_000), COS_SIN),
    "thousands of turns": (np.random.default_rng(2).uniform(-1e5, 1e5, 500), COS_SIN),
    "tiny": (10.0 ** np.random.default_rng(3).uniform(-300, 0, 300), COS_SIN),
    "far": (10.0 ** np.random.default_rng(4).uniform(5, 300, 300), LIBMVEC),
}


@cache
def exact_cosines_and_sines(kind):
    """Return cosines and sines with at least thirty correct digits at the largest angle."""
    angles = ANGLES[kind][0]
    with mpmath.workdps(50 + max(0, int(np.log10(np.abs(angles).max())))):
        angles = list(map(mpmath.mpf, angles.tolist()))
        return list(map(mpmath.cos, angles)), list(map(mpmath.sin, angles))


@pytest.mark.parametrize("chosen_set", SETS)
@pytest.mark.parametrize("kind", ANGLES)
def test_sin_and_cos_match_30_digit_reference(kind, chosen_set, sources):
    angles, tolerance = ANGLES[kind]
    exact = exact_cosines_and_sines(kind)
    for values, expected in zip(turn(compiled(sources, chosen_set), angles), exact, strict=True):
        assert units_off(values, expected) <= (LIBMVEC if chosen_set == "baseline" else tolerance)


def points(kind, count=800):
    """Return arguments (y, x) of atan2 for angles in all quadrants."""
    rng = np.random.default_rng(5)
    turn, size = rng.uniform(-np.pi, np.pi, count), 10.0 ** rng.uniform(-300, 300, count)
    signs = rng.choice([-1.0, 1.0], (2, count))
    near = rng.uniform(0.5, 2, count)
    tiny = 10.0 ** rng.uniform(-16, -1, count)
    return {
        "circle": lambda: (np.sin(turn), np.cos(turn)),
        "every size": lambda: (size * np.sin(turn), size * np.cos(turn)),
        "unlike sizes": lambda: (signs[0] * size, signs[1] * rng.permutation(size)),
        "near x": lambda: (signs[0] * tiny * near, signs[1] * near),
        "near y": lambda: (signs[0] * near, signs[1] * tiny * near),
        "near diagonals": lambda: (signs[0] * near * (1 + tiny), signs[1] * near),
        "near half": lambda: (signs[0] * near * (0.5 + tiny / 8), signs[1] * near),
        "denormal": lambda: tuple(signs * rng.integers(1, 1 << 20, (2, count)) * 5e-324),
    }[kind]()


KINDS = (
    *("circle", "every size", "unlike sizes", "near x", "near y"),
    *("near diagonals", "near half", "denormal"),
)


@cache
def exact_angles(kind):
    """Return the coordinates y and x of points, and their angles with fifty digits."""
    ys, xs = points(kind)
    with mpmath.workdps(50):
        pairs = zip(ys.tolist(), xs.tolist(), strict=True)
        return ys, xs, [mpmath.atan2(*map(mpmath.mpf, pair)) for pair in pairs]


@pytest.mark.parametrize("chosen_set", SETS)
@pytest.mark.parametrize("kind", KINDS)
def test_atan2_matches_50_digit_reference(kind, chosen_set, sources):
    ys, xs, exact = exact_angles(kind)
    got = batch(compiled(sources, chosen_set), "atan2", xs, ys)
    there = (np.abs(np.array(exact, float)) > 2.3e-308).nonzero()[0]
    assert len(there) > 350
    assert units_off(got[there], [exact[k] for k in there]) <= ANGLE


@pytest.mark.parametrize("chosen_set", SETS)
def test_atan2_is_exact_on_axes_and_diagonals(chosen_set, sources):
    library = compiled(sources, chosen_set)
    for size in (5e-324, 1e-310, 1e-160, 1.0, 3.0, 1e160, 1.7e308, np.inf):
        ys, xs = np.array(list(itertools.product((0.0, -0.0, size, -size), repeat=2))).T.copy()
        assert_same(batch(library, "atan2", xs, ys), np.arctan2(ys, xs))


@pytest.mark.parametrize("chosen_set", SETS)
def test_sin_and_cos_handle_tiny_huge_and_non_finite_angles(chosen_set, sources, numbers):
    library = compiled(sources, chosen_set)
    near, far = np.array([0.0, -0.0, 5e-324, -5e-324, 1e-310, -1e-310]), numbers[0]
    c, s = turn(library, near)
    assert_same(c, np.ones(6))
    assert_same(s, near)
    c, s = turn(library, far)
    assert_near(c, np.cos(far))
    assert_near(s, np.sin(far))
    # A large angle, an infinity or NaN in one element of a SIMD vector does not change the other
    # elements.
    alone = turn(library, np.ones(8))
    for bad in (1e6, np.inf, np.nan):
        for got, expected in zip(turn(library, np.array([bad, *np.ones(7)])), alone, strict=True):
            assert_same(got[1:], expected[1:])


@pytest.mark.parametrize(
    ("program", "flags", "chosen_set"),
    [("g++", (), "avx2"), ("clang", ("-mavx2", "-mfma"), "baseline")],
    ids=["g++ without flags", "clang with AVX2 everywhere"],
)
def test_other_compilers_give_same_vector_results(
    program, flags, chosen_set, sources, scalar, numbers
):
    path = path_of(program)
    language = ("-x", "c++") if program == "g++" else ()
    library = compiled(sources, chosen_set, *flags, program=(path, *language))
    for name in CASES:
        got = batch(library, name, *numbers)
        assert_alike(name, got, scalar(name))
    c, s = turn(library, numbers[0])
    assert_near(c, np.cos(numbers[0]))
    assert_near(s, np.sin(numbers[0]))


def test_code_of_clang_takes_the_instruction_set_of_the_flags(sources):
    """Zig compiles like clang, but its runtime library does not report processor features."""
    flags = ("-march=x86-64-v4", f"{SUPPORTS}undeclared")
    command = [path_of("clang"), "-O0", *flags, "-c", f"{ROBOT.name}_batch.c", "-o", "one_set.o"]
    subprocess.run(command, cwd=sources, check=True)


REFUSED = {
    "no value": (sp.Piecewise((x, x > 0)), "no value if no condition is true"),
    "power": (sp.Rational(1, 2) ** x, "no conversion to CasADi for the power"),
    "third root": (sp.Abs(x) ** sp.Rational(1, 3), "no conversion to CasADi for the power"),
    "gamma": (sp.gamma(x), "no conversion to CasADi for gamma"),
    "exclusive": (
        sp.Piecewise((x, sp.Xor(x > 0, y > 0, evaluate=False)), (y, True)),
        "no conversion to CasADi for Xor",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_unsupported_operation_is_rejected_by_name(name):
    expression, message = REFUSED[name]
    with pytest.raises(LoweringError, match=message):
        lower([function("refused", expression)], "robot")


def test_parameter_conditions_are_resolved_during_lowering():
    a = sp.Symbol("a", real=True)
    terms = Terms({a: sp.Integer(2)})
    expression = sp.Piecewise((x, a > 1), (sp.sqrt(x), True))
    result = Result("value", (expression,), (1,), "1", "a number")
    arguments = (Argument("x", (x,), (1,), "1", "a number"),)
    function = SymbolicFunction("f", "", "", arguments, (result,), terms)
    assert programs([function], "robot").whole["f"].computed == []
