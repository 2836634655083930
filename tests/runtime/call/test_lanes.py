"""Batches with vector code agree with single calls."""

import functools

import numpy as np
import pytest

import chasles
from chasles.contract import read_manifest
from tests.support.derivations import NAMES as SERIAL

ROUNDING = 16
"""Tolerance in units in the last place (ULP) of the largest entry of all rows, or of 1 if all
entries are smaller. Small loop residuals are differences of lengths of about 1."""
LARGE = (4 << 20) // 8 + 1
"""A result with at least this number of doubles is written by streaming stores."""
LENGTHS = [*range(18), 23, 24, 25, 31, 32, 33, 40]
"""Batch sizes near multiples of the number of SIMD lanes."""
POSE_BY_POSE = {"modes"}
"""Functions that are tested with few batch sizes, because they have no vector code and take
milliseconds per pose."""
FEW = 8

LOOPS = ["well_manipulator", "delta", "planar_3rrr"]
"""Robots with loops: one with triangles that contain cylinders, one with spherical joints, and one
with a platform on three legs."""
NEAR = 0.02
"""The loops of the robots in ``LOOPS`` close within this distance (radian or meter) from the
reference."""
NAMES = [*SERIAL, *LOOPS]
ROBOTS = {name: chasles.load(name) for name in NAMES}


def in_C(robot):
    """List the generated functions whose first input is a vector of coordinates.

    Other tests cover functions whose first input is a pose, such as the inverse kinematics
    functions.
    """
    functions = read_manifest(robot.folder).functions
    return [item.name for item in functions if item.inputs[0].name != "T"]


FUNCTIONS = [(name, item) for name in NAMES for item in in_C(ROBOTS[name])]
FORWARD = [
    (name, item)
    for name, item in FUNCTIONS
    if name in SERIAL and item != "swivel" and not ROBOTS[name].functions[item].solutions
]
"""Functions of serial robots whose first input is a vector of coordinates. The swivel angle is
excluded, because a nearly stretched elbow amplifies rounding errors."""


def each(pairs):
    """Return a decorator that runs a test for all (robot, function) pairs.

    A robot and all its functions form one test case.
    """

    def decorate(test):
        @functools.wraps(test, assigned=("__module__", "__name__", "__qualname__", "__doc__"))
        def of_robot(name):
            items = [item for robot, item in pairs if robot == name]
            assert items
            for item in items:
                try:
                    test(name, item)
                except Exception as error:
                    error.add_note(f"the function is {name}.{item}")
                    raise

        del of_robot.__wrapped__
        return pytest.mark.parametrize("name", sorted({name for name, _ in pairs}))(of_robot)

    return decorate


every_function = each(FUNCTIONS)
KINDS = ("lynxmotion", "panda", "well_manipulator")
"""Robots that are tested with large batches: arms with five and seven joints, and a boom with
cylinders."""
every_function_in_lanes = each(
    [(name, item) for name, item in FUNCTIONS if name in KINDS and item not in POSE_BY_POSE]
)
centers = {}
"""Pairs of a function and coordinates at which the loops of the robot close, keyed by
`id(function)`. The coordinates of a function are keyed by argument name."""


def find(name, item):
    robot = ROBOTS[name]
    function = robot.functions[item]
    if robot.loops:
        q = np.array(robot.reference.q)
        places = {"q": q, "theta": robot.chain(q), "z": np.array(robot.reference.z)}
        centers[id(function)] = (function, places)
    return function


def make_inputs(function, *batch, seed=1, scale=np.pi):
    """Return random coordinates and joint rates as inputs of a function.

    Each joint rate is between -2 and 2.
    """
    rng = np.random.default_rng(seed)
    _, places = centers.get(id(function), (function, {}))
    scales = [scale, *[2.0] * (len(function.inputs) - 1)]
    return [
        rng.uniform(-size, size, (*batch, *item.shape))
        if item.name not in places
        else places[item.name] + rng.uniform(-1, 1, (*batch, *item.shape)) * NEAR * scale / np.pi
        for item, size in zip(function.inputs, scales, strict=True)
    ]


def call(function, *inputs, **keywords):
    """Call a robot function, and list its results without the fields that Python computes."""
    result = function(*inputs, **keywords)
    return list(result[: len(function.outputs)]) if isinstance(result, tuple) else [result]


def assert_same(got, expected):
    for a, b in zip(got, expected, strict=True):
        np.testing.assert_array_equal(a, b)


def assert_close(got, expected):
    """Assert that results agree up to rounding errors.

    Both results must have non-finite values in the same entries.
    """
    for a, b in zip(got, expected, strict=True):
        finite = np.isfinite(b)
        np.testing.assert_array_equal(np.isfinite(a), finite)
        if finite.any():
            unit = np.spacing(max(np.abs(b[finite]).max(), 1.0))
            assert np.abs(a[finite] - b[finite]).max() <= ROUNDING * unit


def alone(function, *row):
    """Return the results of a function for one row of inputs.

    If a single call raises an error because a loop cannot close, the results come from a batch of
    one row.
    """
    try:
        return call(function, *row)
    except chasles.OutOfReachError:
        return [x[0] for x in call(function, *(np.asarray(x)[None] for x in row))]


def loop(function, *inputs):
    rows = [alone(function, *row) for row in zip(*inputs, strict=True)]
    return [np.stack(column) for column in zip(*rows, strict=True)]


def test_function_list_covers_all_shipped_functions():
    assert len(FUNCTIONS) > 270
    assert len(FORWARD) > 170


@every_function
def test_batch_of_every_length_equals_single_calls(name, item):
    function = find(name, item)
    inputs = make_inputs(function, LENGTHS[-1])
    whole = call(function, *inputs)
    single = loop(function, *inputs)
    assert_close(whole, single)
    for n in LENGTHS[:FEW] if item in POSE_BY_POSE else LENGTHS:
        # Each batch contains the last n rows, so the SIMD lane of a row depends on n. The result of
        # a row must not depend on its lane.
        got = call(function, *(x[len(x) - n :] for x in inputs))
        assert [x.shape for x in got] == [(n, *out.shape) for out in function.outputs]
        assert_same(got, [x[len(x) - n :] for x in (single if n == 1 else whole)])


@each(FORWARD)
def test_huge_or_tiny_coordinates_do_not_affect_other_rows(name, item):
    function = find(name, item)
    plain = call(function, *make_inputs(function, 37))
    for scale in (1e5, 1e15, 1e300, 1e-310):
        # A prismatic joint overflows at values that a revolute joint treats as many full turns.
        inputs = make_inputs(function, 37, scale=scale)
        assert_close(call(function, *inputs), loop(function, *inputs))
        mixed = make_inputs(function, 37)
        mixed[0][::5] = inputs[0][::5]
        usual = np.arange(37) % 5 != 0
        got = call(function, *mixed)
        assert_same([x[usual] for x in got], [x[usual] for x in plain])


@every_function
def test_non_finite_row_does_not_affect_other_rows(name, item):
    function = find(name, item)
    count = FEW if item in POSE_BY_POSE else 19
    clean = make_inputs(function, count)
    expected = call(function, *clean)
    for row in range(count):
        # The test inserts NaN, inf and -inf into every argument of the function.
        bad = (np.nan, np.inf, -np.inf)[(row + row // 3) % 3]
        argument = row % len(clean)
        spoiled = [x.copy() for x in clean]
        entries = spoiled[argument].reshape(count, -1)
        entries[row, row % entries.shape[1]] = bad
        with np.errstate(all="raise"):
            got = call(function, *spoiled)
        others = np.arange(count) != row
        assert_same([x[others] for x in got], [x[others] for x in expected])
        single = alone(function, *(x[row] for x in spoiled))
        for a, b in zip(got, single, strict=True):
            np.testing.assert_array_equal(np.isnan(a[row]), np.isnan(b))


def test_non_finite_coordinate_gives_nan_in_its_pose_only():
    for name in SERIAL:
        function = find(name, "fk")
        q = make_inputs(function, 16)[0]
        q[3] = np.nan
        assert np.isnan(function(q)[3]).any()
        assert np.isfinite(function(q)[4:]).all()


LAYOUTS = {
    "gaps": lambda a: np.repeat(a, 2, axis=0)[::2],
    "reversed": lambda a: np.ascontiguousarray(a[::-1])[::-1],
    "columns of a table": lambda a: np.pad(a, [(0, 0)] * (a.ndim - 1) + [(1, 2)])[..., 1:-2],
    "backwards": lambda a: np.ascontiguousarray(a[:, ::-1])[:, ::-1],
    "fortran": np.asfortranarray,
    "odd address": lambda a: np.concatenate([[0.0], a.ravel()])[1:].reshape(a.shape),
}
CORE_IS_DENSE = {"gaps", "reversed", "columns of a table", "odd address"}


@each([*FORWARD, *((n, item) for n, item in FUNCTIONS if n in LOOPS)])
def test_row_memory_layout_does_not_change_results(name, item):
    function = find(name, item)
    inputs = make_inputs(function, 29)
    expected = call(function, *inputs)
    for layout, arrange in LAYOUTS.items():
        got = call(function, *(arrange(x) if x.ndim > 1 else x for x in inputs))
        same = assert_same if layout in CORE_IS_DENSE else assert_close
        same(got, expected)


@pytest.mark.parametrize("name", SERIAL)
def test_broadcast_inputs_equal_dense_inputs(name):
    function = find(name, "twist_mixed")
    q, qd = make_inputs(function, 1000)
    q, qd = q[:, None], qd[None, :50]
    result = function(q, qd)
    assert result.shape == (1000, 50, 6)
    dense = [np.ascontiguousarray(np.broadcast_to(x, (1000, 50, q.shape[-1]))) for x in (q, qd)]
    np.testing.assert_array_equal(result, function(*dense))
    # A single row broadcasts against all rows, in either argument.
    np.testing.assert_array_equal(function(q[7, 0], qd[0]), result[7])
    np.testing.assert_array_equal(function(q[:, 0], qd[0, 7]), result[:, 7])


def large_batch(function):
    smallest = min(int(np.prod(item.shape)) for item in function.outputs)
    return LARGE // smallest + 3


@every_function_in_lanes
def test_large_batch_results_equal_small_batch_results(name, item):
    function = find(name, item)
    n = large_batch(function)
    inputs = make_inputs(function, n)
    large = call(function, *inputs)
    assert min(x.nbytes for x in large) > LARGE * 8
    rng = np.random.default_rng(2)
    for first in [0, n - 40, *rng.integers(0, n - 40, 5)]:
        part = slice(first, first + 40)
        assert_same([x[part] for x in large], call(function, *(x[part] for x in inputs)))


@pytest.mark.parametrize(
    ("name", "length"), [("ur5e", "short"), ("panda", "short"), ("panda", "large")]
)
@pytest.mark.parametrize("item", ["fk", "fk_jacobian_mixed", "twist_mixed", "hessian_mixed"])
def test_out_alignment_does_not_change_results(name, item, length):
    function = find(name, item)
    n = 21 if length == "short" else large_batch(function)
    inputs = make_inputs(function, n)
    expected = call(function, *inputs)
    sizes = [x.size for x in expected]
    buffer = np.empty(sum(sizes) + 32)
    for shift in range(9):
        buffer[:] = -77.0
        outs, start = [], shift
        for x in expected:
            outs.append(buffer[start : start + x.size].reshape(x.shape))
            start += x.size + 3
        got = call(function, *inputs, out=tuple(outs))
        assert all(a is b for a, b in zip(got, outs, strict=True))
        assert_same(got, expected)
        assert np.count_nonzero(buffer == -77.0) == buffer.size - sum(sizes)


def test_out_may_be_reversed_table_columns():
    function = find("ur5e", "twist_mixed")
    inputs = make_inputs(function, 50)
    expected = function(*inputs)
    table = np.zeros((50, 9))
    function(*inputs, out=table[::-1, 1:7])
    np.testing.assert_array_equal(table[::-1, 1:7], expected)
    assert not table[:, [0, 7, 8]].any()
