"""Functions with branches agree with 40-digit results in scalar, vector and batch code.

For each branch, the oracle inserts the signs of the branch into the derived terms.
"""

import ctypes
import itertools
import subprocess
from functools import cache

import mpmath
import numpy as np
import pytest
import sympy as sp

import chasles
from chasles import ManifestError
from chasles.contract import read_manifest
from chasles.derive.emit.c.header import support
from chasles.derive.program.operations import Operation
from chasles.derive.program.programs import programs
from chasles.derive.terms.branches import patterns
from tests.support.compiling import COMPILER, compiled_quickly
from tests.support.loops import branched
from tests.support.processor import require_features
from tests.support.tolerances import EXACT_CODE, NEAR_ROOT, RECIPROCAL_ROOT
from tests.support.tools import needs, path_of

pytestmark = needs("gcc")


PREFIX = "ur5e"
"""Name of the robot whose C sources contain the tested functions."""
FASTEST = COMPILER or "gcc"
"""The compiler is Clang if available, because Clang compiles batches four times faster than GCC."""
ROWS = 9
"""Number of input rows per function, which exceeds one SIMD vector of eight doubles."""
MANY = ("every_kind_8", "every_kind_16")
"""Functions whose batch code takes long to compile for the oldest processors.

The batch code of these functions is tested only with the instruction sets of newer processors.
"""
COUNTS = {"ik": 8, **{f"every_kind_{2**n}": 2**n for n in range(5)}}
AVX2, AVX512 = {"avx2", "fma"}, {"avx2", "fma", "avx512f", "avx512dq", "avx512vl"}
INSTRUCTION_SETS = {"plain": set(), "avx2": AVX2, "avx512": AVX512}
"""Processor features that the C code needs for each instruction set."""
every_isa = pytest.mark.parametrize("isa", INSTRUCTION_SETS)
FILLED = {"every_kind_8": ("plain", "avx2"), "every_kind_16": ("plain", "avx512")}
"""Instruction sets to test for functions whose branches fill two SIMD vectors."""
EVERY_ISA = [(name, isa) for name in COUNTS for isa in FILLED.get(name, INSTRUCTION_SETS)]


@cache
def branched_function(name):
    """Derive ``ik`` of an arm, or a branched function that contains every type of expression."""
    return branched.arm() if name == "ik" else branched.every_kind(COUNTS[name].bit_length() - 1)


@pytest.fixture(scope="module")
def sources(tmp_path_factory):
    folder = tmp_path_factory.mktemp("branched")
    return branched.write(folder, [branched_function(name) for name in COUNTS if name not in MANY])


@pytest.fixture(scope="module")
def many_sources(tmp_path_factory):
    return {
        name: branched.write(tmp_path_factory.mktemp(name), [branched_function(name)])
        for name in MANY
    }


@pytest.fixture(scope="module")
def arm_sources(tmp_path_factory):
    return branched.write(tmp_path_factory.mktemp("arm"), [branched_function("ik")])


@pytest.fixture(scope="module")
def loadable(tmp_path_factory):
    """Return a robot folder in which only the function `ik` has branches."""
    folder = tmp_path_factory.mktemp("loadable")
    return branched.write(folder, [branched_function("ik"), branched_function("every_kind_1")])


def compiled(folder, isa, *flags, program=FASTEST, batches=True):
    require_features(INSTRUCTION_SETS[isa])
    target = folder / f"{isa}{''.join(flags)}{program}.so"
    if not target.exists():
        flags = ("-shared", "-fPIC", *flags, "-o", str(target), "-lm")
        run_compiler(folder, isa, program, *flags, batches=batches)
    return ctypes.CDLL(str(target))


def run_compiler(folder, isa, program, *flags, batches=True):
    """Compile the scalar code and, by default, the batch code for one instruction set.

    A compiler warning counts as an error.
    """
    sources = [f"{PREFIX}.c", *([f"{PREFIX}_batch.c"] if batches else [])]
    command = [
        *(program, "-O1", "-fno-math-errno", "-fno-trapping-math", "-Wall", "-Wextra"),
        *("-Werror", "-Wno-psabi", *(f"-m{feature}" for feature in sorted(INSTRUCTION_SETS[isa]))),
        *(("-x", "c++") if program == "g++" else ()),
        *(*sources, *flags),
    ]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[:2000]


def pointer(array):
    return array.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


def one(library, function, inputs):
    """Call a C function for one input, and assert that it writes nothing beyond its outputs."""
    results = [np.full(item.size + 1, -77.0) for item in function.outputs]
    buffers = [np.array(x, float).ravel() for x in inputs]
    library[f"{PREFIX}_{function.name}"](*map(pointer, (*buffers, *results)))
    assert all(x[-1] == -77.0 for x in results)
    return [x[:-1].reshape(r.shape) for x, r in zip(results, function.outputs, strict=True)]


def batch(library, function, inputs):
    """Call the batch version of a C function with one input per row."""
    n = len(inputs[0])
    buffers = [np.ascontiguousarray(x, float).reshape(n, -1) for x in inputs]
    results = [np.full((n, *item.shape), -77.0) for item in function.outputs]
    call = library[f"{PREFIX}_{function.name}_batch"]
    call(ctypes.c_size_t(n), *map(pointer, (*buffers, *results)))
    return results


def evaluated(expression):
    """Convert a SymPy expression to a function that takes a dictionary of symbol values."""
    names = sorted(expression.free_symbols, key=str)
    call = sp.lambdify(names, expression, "mpmath", dummify=True)
    return lambda values: call(*(values[name] for name in names))


class Oracle:
    """Evaluates each branch of a function at 40-digit precision."""

    def __init__(self, function):
        self.function = function
        self.terms = {symbol: evaluated(term) for symbol, term in function.definitions()}
        self.entries = [list(map(evaluated, result.entries)) for result in function.outputs]

    def __call__(self, inputs):
        function, results = self.function, [[] for _ in self.function.outputs]
        with mpmath.workdps(40):
            terms = function.terms
            given = {s: mpmath.mpf(str(terms.value(s))) for s in terms.constants}
            for argument, x in zip(function.inputs, inputs, strict=True):
                numbers = map(mpmath.mpf, np.ravel(x).tolist())
                given |= dict(zip(argument.symbols, numbers, strict=True))
            for signs in patterns(function):
                values = given | dict(zip(function.signs, map(mpmath.mpf, signs), strict=True))
                for symbol, term in self.terms.items():
                    values[symbol] = term(values)
                for found, entries in zip(results, self.entries, strict=True):
                    found += [float(entry(values)) for entry in entries]
        return [
            np.array(x).reshape(result.shape)
            for x, result in zip(results, function.outputs, strict=True)
        ]


def poses(count, seed=1):
    """Return random poses (count, 4, 4) of the arm."""
    q = np.random.default_rng(seed).uniform(-np.pi, np.pi, (count, 6))
    return chasles.load("ur5e").fk(q)


def make_inputs(function, count, seed=1):
    if function.name == "ik":
        return [poses(count, seed)]
    rng = np.random.default_rng(seed)
    return [rng.uniform(-3, 3, (count, *item.shape)) for item in function.inputs]


def apart(got, expected):
    """Return the largest difference of two results, modulo full turns."""
    difference = np.abs(got - expected)
    return np.minimum(difference, np.abs(difference - 2 * np.pi)).max()


@cache
def references(name):
    """Return the inputs of a function, and the exact outputs for each row of the inputs."""
    function = branched_function(name)
    oracle, inputs = Oracle(function), make_inputs(function, ROWS)
    return inputs, [oracle([x[k] for x in inputs]) for k in range(ROWS)]


@pytest.mark.parametrize(("name", "isa"), EVERY_ISA)
def test_every_branch_matches_40_digit_reference(name, isa, sources, many_sources):
    function, batches = branched_function(name), name not in MANY or isa != "plain"
    library = compiled(many_sources.get(name, sources), isa, batches=batches)
    inputs, exact_rows = references(name)
    together = batch(library, function, inputs) if batches else None
    for k, expected in enumerate(exact_rows):
        row = [x[k] for x in inputs]
        assert [x.shape[0] for x in expected] == [COUNTS[name]] * len(expected)
        found = [one(library, function, row), *([[x[k] for x in together]] if batches else [])]
        for results in found:
            for got, exact in zip(results, expected, strict=True):
                assert apart(got, exact) <= NEAR_ROOT


@every_isa
def test_solutions_reach_the_target(isa, sources):
    library, fk = compiled(sources, isa), chasles.load("ur5e").fk
    targets = poses(200, seed=3)
    for T in targets:
        q, residual, margin = one(library, branched_function("ik"), [T])
        reached = residual <= 1e-9
        assert reached.any()
        assert np.abs(fk(q[reached]) - T).max() <= EXACT_CODE
        assert (margin[reached] >= -1e-12).all()
    T = targets[0].copy()
    T[:3, 3] *= 100
    q, residual, margin = one(library, branched_function("ik"), [T])
    assert np.isfinite(q).all()
    assert (residual > 1).all()
    assert (margin < 0).all()


@every_isa
def test_nan_invalidates_its_own_row_alone(isa, sources):
    library, targets = compiled(sources, isa), poses(19)
    clean = batch(library, branched_function("ik"), [targets])
    for row, entry in itertools.product(range(19), (0, 3, 7)):
        spoiled = targets.copy()
        spoiled[row].flat[entry] = np.nan
        got = batch(library, branched_function("ik"), [spoiled])
        others = np.arange(19) != row
        for a, b in zip(got, clean, strict=True):
            np.testing.assert_array_equal(a[others], b[others])
        for residual in (got[1][row], one(library, branched_function("ik"), [spoiled[row]])[1]):
            assert not (residual <= 1e-9).any()


@every_isa
def test_output_may_alias_input(isa, sources):
    library, T = compiled(sources, isa), poses(1)[0]
    expected, *_ = one(library, branched_function("ik"), [T])
    q, residual, margin = np.zeros(48), np.zeros(8), np.zeros(8)
    q[:16] = T.ravel()
    library[f"{PREFIX}_ik"](*map(pointer, (q, q, residual, margin)))
    np.testing.assert_array_equal(q.reshape(8, 6), expected)


def assert_exact(library):
    (targets,), exact_rows = references("ik")
    for got, exact in zip(
        one(library, branched_function("ik"), [targets[0]]), exact_rows[0], strict=True
    ):
        assert apart(got, exact) <= NEAR_ROOT


@pytest.mark.parametrize("flags", [("-DCHASLES_PLAIN",), ("-std=c99",)], ids=["plain", "c99"])
def test_other_compiler_flags_give_exact_results(flags, sources, arm_sources):
    """The test runs only the single-pose code of `ik`.

    The batch functions and all other functions only have to compile without a warning.

    Tests with `compiled_quickly` and tests of the package compile robots at other optimization
    levels.
    """
    assert_exact(compiled(arm_sources, "avx2", *flags, program="gcc", batches=False))
    run_compiler(sources, "avx2", FASTEST, "-fsyntax-only", *flags)


@pytest.mark.parametrize(("program", "isa"), [("g++", "plain"), ("g++", "avx512")])
def test_other_compilers_give_exact_results(program, isa, sources, arm_sources):
    """The test runs only `ik` without batches, and compiles all other code without warnings."""
    path_of(program)
    assert_exact(compiled(arm_sources, isa, program=program, batches=False))
    run_compiler(sources, isa, program, "-fsyntax-only")


def test_loaded_branch_functions_have_expected_shapes(loadable):
    with compiled_quickly():
        robot = chasles.load(loadable)
    infos = read_manifest(loadable).functions
    assert {info.name: len(info.role.labels) for info in infos} == {"ik": 8, "every_kind_1": 0}
    T = poses(1000)
    solutions = robot.functions["ik"](T)
    shapes = (solutions.q.shape, solutions.residual.shape, solutions.margin.shape)
    assert shapes == ((1000, 8, 6), (1000, 8), (1000, 8))
    assert apart(robot.functions["ik"](T[7]).q, solutions.q[7]) <= NEAR_ROOT
    value, least, direction = robot.functions["every_kind_1"](0.5, np.ones((9, 2)))
    assert (value.shape, least.shape, direction.shape) == ((9, 1, 5), (9, 1), (9, 1))


def test_wrong_label_count_is_rejected(loadable, tmp_path):
    text = (loadable / "manifest.json").read_text()
    (tmp_path / "manifest.json").write_text(text.replace('"slot 7"', '"slot 7", "slot 8"', 1))
    with pytest.raises(ManifestError, match=r"labels.*first dimension of every output"):
        read_manifest(tmp_path)


LANES = {"baseline": (0, set()), "avx2": (1, AVX2), "avx512": (2, AVX512)}
"""Index of each instruction set in the C code, and the processor features that the set needs."""
CALLS = """\
#define CHASLES_ISA {}
#include "chasles_lanes.h"
void rsqrt(size_t n, const double *x, double *value) {{
  for (; n >= LANES; n -= LANES, x += LANES, value += LANES)
    LANES_NAME(lanes_rsqrt)((const lanes *)x, (lanes *)value);
}}
void supplement(size_t n, const double *a, const double *y, double *value) {{
  for (; n >= LANES; n -= LANES, a += LANES, y += LANES, value += LANES)
    LANES_NAME(lanes_supplement)((const lanes *)a, (const lanes *)y, (lanes *)value);
}}
"""


@pytest.fixture(scope="module", params=LANES)
def on_lanes(request, tmp_path_factory):
    """Compile C code with SIMD vectors for one instruction set.

    The fixture returns a function that applies a compiled C function to arrays.
    """
    number, needed = LANES[request.param]
    require_features(needed)
    folder = tmp_path_factory.mktemp(request.param)
    (folder / "calls.c").write_text(CALLS.format(number))
    (folder / "chasles_lanes.h").write_text(support("chasles_lanes.h"))
    flags = ("-O2", "-Wno-psabi", "-shared", "-fPIC", *(f"-m{f}" for f in sorted(needed)))
    subprocess.run(["gcc", *flags, "calls.c", "-o", "calls.so"], cwd=folder, check=True)
    library = ctypes.CDLL(str(folder / "calls.so"))

    def call(name, *arrays):
        n, size = len(arrays[0]), -(-len(arrays[0]) // 8) * 8
        buffers = np.zeros((len(arrays) + 2, size))
        # Vector loads of the kernels need buffers that are aligned to cache lines.
        buffers = buffers.ravel()[-(buffers.ctypes.data // 8) % 8 :][: size * (len(arrays) + 1)]
        buffers = buffers.reshape(-1, size)
        buffers[:-1, :n] = arrays
        library[name](ctypes.c_size_t(size), *map(pointer, buffers))
        return buffers[-1, :n]

    return call


def test_vector_reciprocal_root_is_accurate(on_lanes):
    rng = np.random.default_rng(4)
    x = np.concatenate([rng.uniform(1, 4, 200_000), 10.0 ** rng.uniform(-307, 307, 20_000)])
    exact = 1 / np.sqrt(x.astype(np.longdouble))
    off = np.abs(on_lanes("rsqrt", x) - exact) / np.spacing(exact.astype(float))
    assert off.max() <= RECIPROCAL_ROOT
    assert np.isnan(on_lanes("rsqrt", np.array([-1.0, -1e-200, -np.inf, np.nan]))).all()


def test_supplement_equals_angle_of_opposite_point(on_lanes):
    numbers = [0.0, -0.0, 1.0, -1.0, 1e-300, -1e-300, 3.5, -0.1, np.inf, -np.inf]
    y, x = np.array(list(itertools.product(numbers, numbers))).T
    for side in (y, -y):
        got, expected = on_lanes("supplement", np.arctan2(y, x), side), np.arctan2(side, -x)
        np.testing.assert_allclose(got, expected, rtol=0, atol=5e-16)
        assert (np.signbit(got) == np.signbit(expected)).all()
    assert np.isnan(on_lanes("supplement", np.array([np.nan]), np.array([1.0]))).all()


def angles(program):
    return [s.operands for s in program.computed if s.operation is Operation.ATAN2]


def test_shared_branch_angles_are_computed_once():
    made = programs([branched_function("ik")], "arm")
    flat, branch = made.whole["ik"], made.branch["ik"]
    # The absolute angles of joints 3 and 5 do not depend on the branch signs of these joints.
    assert len(angles(flat)) == 2 + 8 + 4 + 8 + 2 + 4
    assert len(set(angles(flat))) == len(angles(flat))
    assert len(angles(branch)) == 6


@pytest.mark.parametrize("name", COUNTS)
def test_first_branch_sign_varies_slowest(name):
    function = branched_function(name)
    n = len(function.signs)
    found = list(patterns(function))
    assert len(found) == COUNTS[function.name]
    for b, signs in enumerate(found):
        assert signs == tuple(-1 if b >> (n - 1 - i) & 1 else 1 for i in range(n))


def test_branch_order_matches_joint_signs(loadable):
    solutions = chasles.load(loadable).functions["ik"](poses(50))
    q, margin = solutions.q, solutions.margin
    as_labelled = np.sign(q[..., 2]) == [1, -1, 1, -1, 1, -1, 1, -1]
    assert as_labelled[margin > 0].all()
    assert (margin > 0).sum() > 300
    np.testing.assert_array_equal(np.sign(q[..., 4]), [[1, 1, -1, -1, 1, 1, -1, -1]] * 50)
