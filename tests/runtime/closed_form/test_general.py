"""The inverse of arms without special structure is complete and correct, also at singularities."""

import ctypes
import itertools
import re
import subprocess

import numpy as np
import pytest

import chasles
from chasles.derive import read, read_text
from chasles.derive.inverse.general.elimination_choice import choose, length
from chasles.derive.inverse.general.raghavan_roth import numbers
from chasles.tolerances import SOLVED
from tests.support.compiling import COMPILER, compiled
from tests.support.derivations import description

DOUBLES = np.ctypeslib.ndpointer(np.float64, flags="C")
NAMES = ("jaco2", "crx10")
"""Names of two arms: the first is installed with the package, and the test derives the second."""
NARROW = "-march=x86-64"
"""Compiler flag for narrower SIMD vectors than in the installed kernels."""
CLOSED = 5e-14
"""Largest pose error (meter or radian) of solutions after Newton's method, away from singularities.
"""
SAME = 1e-6
"""Maximum angle (radian) between two solutions that count as equal."""


@pytest.fixture(scope="module", params=NAMES)
def robot(request, tmp_path_factory):
    if request.param == "jaco2":
        return chasles.load("jaco2")
    folder = tmp_path_factory.mktemp("general") / request.param
    functions = ["fk", "fk_jacobian_mixed", "ik"]
    return compiled(read(description(request.param)), folder, functions, ["c"])


def configurations(robot, count, seed):
    lower = np.where(np.isfinite(robot.lower), robot.lower, -np.pi)
    upper = np.where(np.isfinite(robot.upper), robot.upper, np.pi)
    return np.random.default_rng(seed).uniform(lower, upper, (count, 6))


def wrapped(angle):
    return (angle + np.pi) % (2 * np.pi) - np.pi


def included(solutions, q):
    apart = np.abs(wrapped(solutions.q - q[..., None, :])).max(-1)
    return (solutions.valid & (apart < SAME)).any(-1)


def errors(T, A):
    """Return the errors (..., 6) from pose A to pose T in base axes.

    The first three components are the position error, and the last three are the rotation vector.
    """
    E = T[..., :3, :3] @ np.swapaxes(A[..., :3, :3], -1, -2)
    w = [E[..., 2, 1] - E[..., 1, 2], E[..., 0, 2] - E[..., 2, 0], E[..., 1, 0] - E[..., 0, 1]]
    axis = np.stack(w, -1) / 2
    sine = np.maximum(np.linalg.norm(axis, axis=-1, keepdims=True), 1e-300)
    angle = np.arctan2(sine, (np.trace(E, axis1=-2, axis2=-1)[..., None] - 1) / 2)
    return np.concatenate([T[..., :3, 3] - A[..., :3, 3], axis * (angle / sine)], -1)


def test_ik_recovers_generating_configuration(robot):
    q = configurations(robot, 500, 1)
    solutions = robot.ik(robot.fk(q))
    assert (solutions.count > 0).all()
    assert (solutions.count % 2 == 0).all()
    assert included(solutions, q).all()
    assert solutions.residual[solutions.valid].max() <= CLOSED
    assert (solutions.margin[solutions.valid] > 0).all()
    assert (solutions.margin[~solutions.valid] < 0).all()


def test_nearly_coincident_solutions_are_found(robot):
    # If joint axes intersect, some solutions differ by only 1e-5 rad in the joint angle that the
    # roots of the determinant give. The roots of nearly coincident solutions may become complex,
    # and Newton steps may be too short.
    q = configurations(robot, 4000, 3)
    assert included(robot.ik(robot.fk(q)), q).all()


def test_solutions_do_not_depend_on_simd_width(tmp_path):
    robot, count, library = chasles.load("jaco2"), 300, tmp_path / "ik.so"
    compiler = COMPILER or "gcc"
    command = [compiler, "-std=c99", "-O0", "-shared", "-fPIC", NARROW, "-o", str(library)]
    folders = [f"-I{robot.folder}", f"-I{robot.folder.parent / 'support'}"]
    source = robot.folder / f"{robot.name}.c"
    subprocess.run([*command, *folders, str(source), "-lm"], check=True)
    solve = getattr(ctypes.CDLL(str(library)), f"{robot.name}_ik")
    solve.argtypes, solve.restype = [DOUBLES] * 4, None
    T = robot.fk(configurations(robot, count, 11))
    q, residual, margin = np.empty((count, 16, 6)), np.empty((count, 16)), np.empty((count, 16))
    for k in range(count):
        solve(T[k], q[k], residual[k], margin[k])
    solutions = robot.ik(T)
    assert ((residual <= SOLVED).sum(-1) == solutions.count).all()
    apart = np.abs(wrapped(solutions.q[:, :, None] - q[:, None])).max(-1)
    apart[residual[:, None].repeat(16, 1) > SOLVED] = np.inf
    other = apart.argmin(-1)
    assert (apart.min(-1)[solutions.valid] < SAME).all()
    off = solutions.margin - np.take_along_axis(margin, other, -1)
    assert np.abs(off[solutions.valid]).max() < 1e-6
    assert solutions.valid.sum() > 1000


def test_valid_solutions_reach_pose_and_are_distinct(robot):
    T = robot.fk(configurations(robot, 200, 2))
    solutions = robot.ik(T)
    off = np.abs(robot.fk(solutions.q) - T[:, None]).max((-1, -2))
    assert off[solutions.valid].max() <= CLOSED
    assert off[~solutions.valid].min() > SOLVED / 10
    pairs = 0
    for q, valid in zip(solutions.q, solutions.valid, strict=True):
        for one, other in itertools.combinations(q[valid], 2):
            pairs += 1
            assert np.abs(wrapped(one - other)).max() > SAME
    assert pairs > 1000


def test_valid_solutions_come_first_sorted_by_suppressed_joint(robot):
    order = choose(read(description(robot.name))).orders[0]
    solutions = robot.ik(robot.fk(configurations(robot, 500, 3)))
    assert (solutions.valid == (np.arange(16) < solutions.count[:, None])).all()
    for q, count in zip(solutions.q, solutions.count, strict=True):
        assert (np.diff(q[:count, order.joints[2]]) >= 0).all()


def test_solution_count_matches_multi_start_newton(robot):
    poses = robot.fk(configurations(robot, 2, 4))
    random = np.random.default_rng(5)
    found = [len(everywhere(robot, T, random)) for T in poses]
    assert found == robot.ik(poses).count.tolist()


def everywhere(robot, T, random):
    """Find solutions by Newton's method from 3,000 random configurations."""
    q = random.uniform(-np.pi, np.pi, (3000, 6))
    for k in range(40):
        at, J = robot.fk_jacobian_mixed(q)
        e = errors(T, at)
        if k in (15, 25):
            near = np.abs(e).max(-1) < 0.1
            q, e, J = q[near], e[near], J[near]
        step = np.linalg.solve(J + 1e-12 * np.eye(6), e[..., None])[..., 0]
        q = q + step / np.maximum(1, 2 * np.abs(step).max(-1, keepdims=True))
    q = wrapped(q[np.abs(robot.fk(q) - T).max((-1, -2)) < 1e-10])
    found = []
    for one in q:
        if all(np.abs(wrapped(one - other)).max() > 1e-5 for other in found):
            found.append(one)
    return found


def test_right_angle_poses_are_solved(robot):
    """The test uses 3 % of all configurations at multiples of 90 degrees."""
    q = np.array(list(itertools.product(np.arange(4) * np.pi / 2, repeat=6)))
    q = np.random.default_rng(12).permutation(q)[:128]
    T, J = robot.fk_jacobian_mixed(q)
    solutions = robot.ik(T)
    assert (solutions.count > 0).all()
    regular = np.linalg.svd(J)[1][:, -1] > 1e-6
    assert regular.sum() >= 30
    assert included(solutions, q)[regular].all()


@pytest.mark.parametrize("joint", range(1, 5))
@pytest.mark.parametrize("away", [0.0, 1e-12, 1e-9, 1e-6, 1e-3])
def test_poses_with_single_joint_near_right_angle_are_solved(robot, joint, away):
    q = configurations(robot, 60, 6)
    q[:, joint] = np.pi / 2 * np.random.default_rng(7).integers(-1, 3, len(q)) + away
    solutions = robot.ik(robot.fk(q))
    assert (solutions.count > 0).all()


def test_unreachable_pose_returns_least_squares_solution(robot):
    described = read(description(robot.name))
    size = length(numbers(described))
    T = robot.fk(configurations(robot, 40, 8))
    T[:, :3, 3] += 3.0
    solutions = robot.ik(T)
    assert not solutions.valid.any()
    assert np.isfinite(solutions.q).all()
    assert (solutions.margin == -solutions.residual).all()
    weights = np.repeat([size**-2, 1.0], 3)

    def cost(q):
        return (weights * errors(T[:, None], robot.fk(q)) ** 2).sum(-1)

    costs = cost(solutions.q)
    best = np.take_along_axis(solutions.q, costs.argmin(-1)[:, None, None], 1)
    around = best + np.random.default_rng(9).normal(size=(40, 500, 6)) * 1e-2
    assert (cost(around).min(-1) > costs.min(-1) * (1 - 1e-3)).all()


def test_nan_pose_gives_nan_without_affecting_other_poses(robot):
    T = robot.fk(configurations(robot, 3, 9))
    alone = robot.ik(T[2])
    T[1, 0, 3] = np.nan
    solutions = robot.ik(T)
    assert np.isnan(solutions.q[1]).all()
    assert np.isnan(solutions.residual[1]).all()
    assert not solutions.valid[1].any()
    assert (solutions.q[2] == alone.q).all()


def test_batch_equals_single_calls_on_any_thread_count(robot):
    T = robot.fk(configurations(robot, 300, 10))
    together, threaded = robot.ik(T), robot.ik(T, threads=2)
    for k in range(0, 300, 50):
        assert (robot.ik(T[k]).q == together.q[k]).all()
    assert (threaded.q == together.q).all()
    assert robot.ik(T.reshape(3, 100, 4, 4)).q.shape == (3, 100, 16, 6)


def test_c_and_runtime_share_solution_tolerance():
    header = chasles.load("jaco2").manifest.sources()["chasles_general_equations.h"]
    (value,) = re.findall(r"#define CHASLES_SOLVED (\S+)", header)
    assert float(value) == SOLVED


def test_inner_joints_are_fixed_if_five_axes_are_parallel(tmp_path):
    rows = [(0.3, 0.1, 80)] + [(0.1 * k, 0.2 + 0.03 * k, 0) for k in range(4)]
    rows += [(0.05, 0.1, 70), (0.1, 0.07, -60), (0.2, 0.05, 0)]
    joints = ", ".join(f"{{ d = {d:.2f}, a = {a:.2f}, alpha = {twist} }}" for d, a, twist in rows)
    arm = read_text(f"""
name = "five_parallel"
convention = "dh"
units = {{ length = "m", angle = "deg" }}
joints = [{joints}]
""")
    robot = compiled(arm, tmp_path / arm.name, ["fk", "ik"], ["c"])
    fixed = [entry.index for entry in robot.redundancy]
    assert len(fixed) == 2
    assert set(fixed) < {1, 2, 3, 4, 5}
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (100, 8))
    found = robot.ik(robot.fk(q), fixed={robot.coordinate_names[k]: q[:, k] for k in fixed})
    assert included(found, q).all()
