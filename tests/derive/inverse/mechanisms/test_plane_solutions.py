"""The C solver finds all values of the joints that precede the legs or lie on the platform.

For comparison, Newton's method in NumPy finds solutions from many random starts.
"""

import ctypes
import subprocess
import sysconfig

import numpy as np
import pytest

from chasles.derive.emit.c.header import support
from chasles.derive.emit.c.written import SUPPORTS, table_lines
from chasles.derive.inverse.mechanisms.carried_arm import carried_arm
from chasles.derive.loops.closing.loop_model import loop_model
from chasles.derive.loops.solve.solved_loops import solved_loops
from tests.support.compiling import COMPILER, QUICK
from tests.support.generators.carried_planes import carrying, moved
from tests.support.loops.closures import TINY, Model
from tests.support.loops.legs_of_joints import drawn

POSES, CONFIGURATIONS, STARTS, STEPS = 1, 120, 80, 25
REACH, FAR, LARGEST = 1.0, 2.0, 0.5
"""Maximum deviation of a joint value from the reference, maximum prismatic displacement, and
maximum size of a Newton step."""
CLOSED, SAME = 1e-12, 1e-7
SOURCE = """#include "chasles_carried_arm.h"
static void {name}_ik_legs(const double *T, const double *v, double *q, double *r, double *m)
{{
    (void)T, (void)v, (void)q, (void)r, (void)m;
}}
static void {name}_fk(const double *q, double *T)
{{
    (void)q, (void)T;
}}
{tables}
int solutions(const double *T, const double *given, double *x);
int solutions(const double *T, const double *given, double *x)
{{
    chasles_arm_equations equations;
    chasles_arm_solutions found;
    if (!chasles_arm_setup(&tables, T, given, &equations))
        return 0;
    chasles_arm_solved(&equations, &found);
    for (int k = 0; k < found.count; k++)
        memcpy(x + 3 * k, found.solution[k].x, 3 * sizeof *x);
    return found.count;
}}
"""
LEGS = ("RPS", "PRS", "RRS")
OBLIQUE = [((1, 2, 3), ("0.1", "0.05", "0.1")), ((3, -1, 2), ("0.05", "0.03", "0.02"))]
OBLIQUE += [((-2, 3, 2), ("0.02", "-0.04", "0.1"))]
RAIL, SPIN = ("rail", (2, 1, 3), ("0.1", 0, 0)), ("turntable", (1, 3, -2), (0, "0.1", 0))
ARMS = {
    "three angles": ("", "rrr"),
    "turntable and two angles": (SPIN, "rr"),
    "slide and two angles": ("", "srr"),
    "turntable, angle and slide": (SPIN, "rs"),
    "turntable and two slides": (SPIN, "ss"),
    "rail, slide and angle": (RAIL, "sr"),
    "three slides": ("", "sss"),
    "turntable and slide": (SPIN, "s"),
}
"""For each robot, the joint before the legs, and the types of the joints on the platform (r:
revolute, s: prismatic)."""


@pytest.fixture(params=ARMS)
def solver(request, tmp_path):
    """Return a NumPy model, its unknown joints, and the C solver of these joints."""
    before, behind = ARMS[request.param]
    kinds = ["revolute" if letter == "r" else "prismatic" for letter in behind]
    mechanism = carrying(drawn(4, LEGS), OBLIQUE[: len(behind)], kinds)
    mechanism = moved(mechanism, *before) if before else mechanism
    arm = carried_arm(solved_loops(loop_model(mechanism)))
    joints = [arm.carried.others[k] for k in arm.unknown]
    assert len(joints) == len(arm.carried.others)
    for name in SUPPORTS["carried_arm"]:
        (tmp_path / name).write_text(support(name))
    lines = table_lines(
        mechanism, "chasles_carried_arm_arm", "tables", ("ik_legs", "fk"), arm.tables(1, 6, 1.0)
    )
    text = SOURCE.format(name=mechanism.name, tables="\n".join(lines))
    (tmp_path / "arm.c").write_text(text)
    compiler = COMPILER or sysconfig.get_config_var("CC").split()[0]
    flags = ["-std=gnu99", QUICK, "-shared", "-fPIC"]
    subprocess.run([compiler, *flags, "arm.c", "-o", "arm.so", "-lm"], cwd=tmp_path, check=True)
    function = ctypes.CDLL(str(tmp_path / "arm.so")).solutions

    def solve(T):
        x = np.empty((48, 3))
        pointers = (a.ctypes.data_as(ctypes.c_void_p) for a in (np.ascontiguousarray(T), x))
        count = function(next(pointers), None, next(pointers))
        assert count <= arm.solutions
        return x[:count, : len(joints)]

    return Model(mechanism), joints, solve


def closed(model, joints, rng):
    """Return closed configurations whose joint values vary randomly around the reference."""
    at = dict(model.mechanism.reference)
    z = np.repeat([[float(at.get(name, 0)) for name in model.names]], CONFIGURATIONS, 0)
    own = model.places_of(joint.name for joint in joints)
    z[:, own] += rng.uniform(-REACH, REACH, (len(z), len(own)))
    legs = [k for k in model.actuated if k not in own]
    z[:, legs] += rng.uniform(-0.08, 0.08, (len(z), len(legs)))
    z = model.newton(z, model.actuated)
    return z[model.gap(z) < CLOSED]


def planes(model, start, z):
    """Fit a plane to the positions of each ball joint.

    Return the ball position, the plane normal and the plane offset.
    """
    poses, found = model.poses(z), []
    P = np.linalg.inv(poses[start]) @ poses["platform"]
    balls = [closure.b.placement[0].vector for closure in model.mechanism.closures]
    for ball in np.array(balls, dtype=float):
        at = P[:, :3, :3] @ ball + P[:, :3, 3]
        normal = np.linalg.svd(at - at.mean(0))[2][-1]
        found.append((ball, normal, normal @ at.mean(0)))
    return found


def errors(model, start, fitted, own, x, T):
    """Return the distances (N, 3) of three balls from their planes for joint values x (N, n)."""
    z = np.zeros((len(x), len(model.names)), x.dtype)
    z[:, own] = x
    poses = model.poses(z)
    W = np.linalg.inv(poses["platform"]) @ poses[model.mechanism.tool_body] @ model.tool
    P = np.linalg.inv(poses[start]) @ T @ np.linalg.inv(W)
    return np.stack([(P[:, :3, :3] @ b + P[:, :3, 3]) @ n - d for b, n, d in fitted], -1)


def newton(distances, joints, rng):
    """Return the distinct solutions of Newton's method from random starts."""
    x = rng.uniform(-np.pi, np.pi, (STARTS, len(joints)))
    for _ in range(STEPS):
        moved_by = [x + 1j * TINY * row for row in np.eye(len(joints))]
        J = np.stack([distances(y).imag / TINY for y in moved_by], -1)
        step = -(np.linalg.pinv(J) @ distances(x)[..., None])[..., 0]
        size = np.abs(step).max(-1, keepdims=True)
        x = x + step * np.minimum(1.0, LARGEST / np.maximum(size, TINY))
    x = x[np.abs(distances(x)).max(-1) < CLOSED]
    return x[(np.abs(x[:, is_slide(joints)]) < FAR).all(-1)]


def is_slide(joints):
    return np.array([joint.kind == "prismatic" for joint in joints])


def apart(joints, x, others):
    """Return the distance of each row of joint values x from the nearest row of `others`."""
    change = x[:, None] - others
    angles = ~is_slide(joints)
    change[..., angles] = np.remainder(change[..., angles] + np.pi, 2 * np.pi) - np.pi
    return np.abs(change).max(-1).min(-1)


def test_generating_values_and_solutions_of_newton_are_found(solver):
    model, joints, solve = solver
    rng = np.random.default_rng(7)
    z = closed(model, joints, rng)
    assert len(z) > CONFIGURATIONS / 3
    start = "carriage" if "carriage" in model.poses(z) else model.mechanism.base_frame
    fitted, own = planes(model, start, z), model.places_of(joint.name for joint in joints)
    for k, T in enumerate(model.tip(z)):
        found = solve(T)
        assert apart(joints, z[[k]][:, own], found) < SAME
        if k < POSES:

            def distances(x, T=T):
                return errors(model, start, fitted, own, x, T)

            assert np.abs(distances(found)).max() < SAME
            others = newton(distances, joints, rng)
            assert len(others) > 3
            assert apart(joints, others, found).max() < SAME
