"""Test that each calibration parameter causes the displacement that its name states.

Finite differences of computed poses would not detect a parameter with a wrong name. The tests
therefore compute poses as products of NumPy matrices, built from the parameters' names.
"""

import numpy as np
import pytest
import sympy as sp
from numpy.testing import assert_allclose

from chasles.derive import Coupling, Joint, SerialRobot, read
from chasles.derive.chain.poe import placement_matrix
from chasles.derive.model.mechanism import Strut
from chasles.derive.model.placements import Rotation, rotation, translation
from tests.support.derivations import ROBOTS
from tests.support.loops.parametric import loops_of, nominal, reference
from tests.support.parametric import IN_CONVENTION, functions_of, of_convention

UNITS = {
    **dict.fromkeys(("x", "y", "z", "shift_x", "shift_y", "length"), "m"),
    **dict.fromkeys(("a_x", "a_y", "a_z", "b_x", "b_y", "b_z"), "m"),
    **dict.fromkeys(("roll", "pitch", "yaw", "tilt_x", "tilt_y"), "rad"),
    **dict.fromkeys(("sin1", "cos1", "sin2", "cos2"), "rad"),
    **{f"{side}_turn_{axis}": "rad" for side in "ab" for axis in "xyz"},
    "gain": "1",
}


class Numbers(dict):
    """Parameter values keyed by (joint or body, quantity), with the default value 0."""

    def __init__(self, parameters, p):
        super().__init__(
            {
                (g.joint, g.name.removeprefix(f"{g.joint}_")): v
                for g, v in zip(parameters, p, strict=True)
            }
        )

    def of(self, part, *names):
        return [self.get((part, name), 0.0) for name in names]


def off_by(random, nominal, size, parameters):
    """Return perturbed parameter values with nine decimal places, which are exact fractions.

    The function does not perturb the named parameters of the description, because
    ``test_named_parameters`` covers them.
    """
    size = [0 if g.part == "parameter" else size for g in parameters]
    return np.round(nominal + random.uniform(-1, 1, len(nominal)) * size, 9)


def exact(x):
    return sp.Rational(f"{x:.9f}")


def slid(x, y, z):
    T = np.eye(4)
    T[:3, 3] = x, y, z
    return T


def turned(axis, angle):
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    T = np.eye(4)
    T[i, i] = T[j, j] = np.cos(angle)
    T[j, i], T[i, j] = np.sin(angle), -np.sin(angle)
    return T


def corrected(at, part):
    x, y, z, roll, pitch, yaw = at.of(part, "x", "y", "z", "roll", "pitch", "yaw")
    return slid(x, y, z) @ turned("z", yaw) @ turned("y", pitch) @ turned("x", roll)


def matrix(placement, robot):
    values = {p.symbol: p.value for p in robot.parameters}
    return np.array(placement_matrix(placement).xreplace(values), dtype=float)


def law(at, name, q):
    gain, *waves = at.of(name, "gain", "sin1", "cos1", "sin2", "cos2")
    return gain * q + np.dot(waves, [np.sin(q), np.cos(q), np.sin(2 * q), np.cos(2 * q)])


def moved(at, joint, value, robot):
    """Return the transform (4, 4) from the frame before a joint to the frame after the joint."""
    before, after = joint.before, joint.after
    given = dict(joint.given)
    fields = {n: exact(at[joint.name, n]) for n in given if (joint.name, n) in at}
    if joint.convention and fields:
        numbers = {}
        for f in joint.convention.fields:
            own = tuple(fields.get(n, given[n]) for n in f.components)
            numbers[f.name] = own if f.is_vector else own[0]
        before, after = joint.convention(joint.kind, **numbers)
    off = slid(*at.of(joint.name, "shift_x", "shift_y"), 0)
    for axis in "xy":
        off = off @ turned(axis, *at.of(joint.name, f"tilt_{axis}"))
    motion = turned("z", value) if joint.kind != "prismatic" else slid(0, 0, value)
    if joint.kind == "helical":
        motion = motion @ slid(0, 0, at[joint.name, "pitch"] * value)
    return matrix(before, robot) @ off @ motion @ np.linalg.inv(off) @ matrix(after, robot)


def of_chain(robot, at, q):
    """Return the tool pose of a serial robot for parameter values."""
    T = corrected(at, "base") @ matrix(robot.base, robot)
    laws = {c.name: law(at, c.name, x) for c, x in zip(robot.coordinates, q, strict=True)}
    followed = {
        rule.joint: lambda laws, rule=rule: (
            sum(at[rule.joint, f"per_{name}"] * laws[name] for name, _ in rule.ratios)
            + float(rule.offset)
        )
        for rule in robot.couplings
    }
    for joint in robot.joints:
        if joint.kind == "fixed":
            T = T @ matrix(joint.before, robot) @ matrix(joint.after, robot)
            continue
        value = laws[joint.name] if joint.name in laws else followed[joint.name](laws)
        variable = joint.convention and joint.convention.variable(joint.kind)
        value = joint.direction * value + (0 if variable else at[joint.name, "offset"])
        T = T @ moved(at, joint, value, robot)
    return T @ matrix(robot.tool, robot) @ corrected(at, "tool")


PLAIN = SerialRobot(
    "plain",
    (
        Joint("a", "revolute", translation(0, "0.1", "0.4"), direction=-1),
        Joint("plate", "fixed", rotation("x", "0.3") + translation("0.1", 0, "0.2")),
        Joint("b", "revolute", rotation("y", "0.2"), translation("0.5", 0, 0)),
        Joint("c", "prismatic", rotation("x", "1.1"), direction=-1),
        Joint("d", "prismatic", rotation("y", "0.7"), rotation("z", "0.2")),
    ),
    base=translation(0, "0.2", 0) + rotation("z", "0.5"),
    tool=rotation("x", "0.4") + translation("0.1", "0.2", "0.3"),
    couplings=(Coupling("c", (("b", "1/2"),), "0.1"),),
)


def units(parameters):
    for g in parameters:
        name = g.name.removeprefix(f"{g.joint}_")
        if g.part != "joint" and name in UNITS:
            assert g.unit == UNITS[name], g
            yield g


def chain(name):
    if name in IN_CONVENTION:
        return of_convention(name)
    return functions_of(PLAIN if name == "plain" else read(ROBOTS / f"{name}.toml"), ["fk_p"])


@pytest.mark.parametrize("name", ["plain", *IN_CONVENTION, "bricklaying_planar"])
def test_parametric_fk_matches_numpy_product_far_from_nominal(name):
    derived, functions = chain(name)
    robot = derived.robot
    found, random = derived.geometry.parameters, np.random.default_rng(7)
    assert len(list(units(found))) > 20
    for _ in range(2):
        p = np.array([float(derived.terms.value(g.value)) for g in found])
        p = off_by(random, p, 0.3, found)
        q = random.uniform(-2, 2, len(robot.coordinates))
        T = np.array(functions["fk_p"](q, p)).reshape(4, 4)
        assert_allclose(T, of_chain(robot, Numbers(found, p), q), atol=1e-12)


def bodies(loops, at, w):
    """Return the body frames of a mechanism and the values of its moving members."""
    mechanism = loops.hybrid.mechanism
    n, values = len(loops.hybrid.q), {}
    for coordinate, x in zip(mechanism.coordinates, w[:n], strict=True):
        moves = coordinate.moves
        value = float(loops.terms.value(coordinate.ratio)) * law(at, coordinate.name, x)
        values[moves] = value + sum(at.of(moves, "offset"))
    values |= {v.name: x for v, x in zip(loops.unknown, w[n:], strict=True)}
    frames = {mechanism.base_frame: corrected(at, "base") @ matrix(mechanism.base, mechanism)}
    for joint in mechanism.joints:
        T = frames[joint.parent]
        if joint.kind == "fixed":
            step = matrix(joint.before, mechanism) @ matrix(joint.after, mechanism)
        else:
            step = moved(at, joint, joint.direction * values[joint.name], mechanism)
        frames[joint.link] = T @ step
    return frames, values


def end(loop_joint, side, at, frames, mechanism):
    frame = getattr(loop_joint, side)
    placed = matrix(frame.placement, mechanism)[:3, 3]
    place = [
        at.get((loop_joint.name, f"{side}_{a}"), x) for a, x in zip("xyz", placed, strict=True)
    ]
    turns = tuple(motion for motion in frame.placement if isinstance(motion, Rotation))
    T = frames[frame.body] @ slid(*place) @ matrix(turns, mechanism)
    for axis in "xyz":
        T = T @ turned(axis, *at.of(loop_joint.name, f"{side}_turn_{axis}"))
    return T


WITH_LOOPS = ("four_bar", "slider_crank", "delta", "stewart_gough")
"""Names of mechanisms whose loops contain pins, a slider, rods, or ball-ended cylinders."""


@pytest.mark.parametrize("name", WITH_LOOPS)
def test_parametric_loop_pose_and_residuals_match_numpy_matrices(name):
    loops, functions = loops_of(name)
    mechanism, found = loops.hybrid.mechanism, loops.geometry.parameters
    assert len(list(units(found))) > 8
    random = np.random.default_rng(8)
    p = off_by(random, nominal(loops), 0.05, found)
    w = reference(loops) + random.uniform(-0.2, 0.2, loops.arguments["w"].size)
    at = Numbers(found, p)
    frames, values = bodies(loops, at, w)
    T = frames[mechanism.tool_body] @ matrix(mechanism.tool, mechanism) @ corrected(at, "tool")
    assert_allclose(np.array(functions["tool_p"](w, p)).reshape(4, 4), T, atol=1e-12)
    residuals = list(np.array(functions["closure_p"](w, p)[0]).ravel())
    for loop_joint in mechanism.loop_joints:
        a, b = (end(loop_joint, side, at, frames, mechanism) for side in "ab")
        apart = b[:3, 3] - a[:3, 3]
        if isinstance(loop_joint, Strut):
            length = at[loop_joint.name, "length"]
            length += values[loop_joint.name] if loop_joint.is_cylinder else 0
            assert_allclose(residuals.pop(0), np.linalg.norm(apart) - length, atol=1e-12)
        elif loop_joint.kind in ("pin", "ball") and loop_joint.name in loops.geometry.planar:
            own = [residuals.pop(0), residuals.pop(0)]
            axes = loops.geometry.planar[loop_joint.name].axes[loop_joint.a.body]
            n = frames[loop_joint.a.body][:3, :3] @ np.array(axes.n, dtype=float).ravel()
            in_plane = np.linalg.norm(apart - n * (n @ apart))
            assert_allclose(np.linalg.norm(own), in_plane, atol=1e-12)
        else:
            break
