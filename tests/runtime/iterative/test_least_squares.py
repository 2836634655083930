"""If loops cannot close, the configuration minimizes the sum of their squared closure errors."""

from dataclasses import replace

import numpy as np
import pytest

from chasles.derive import read
from chasles.derive.loops.model.numeric_mechanism import NumericMechanism
from chasles.derive.model.mechanism import Closure
from tests.support.compiling import compiled
from tests.support.generators.as_built import on_links, out_of_plane
from tests.support.loops.closures import Model
from tests.support.loops.mechanisms import five_bar, parallelogram
from tests.support.loops.solved import solved
from tests.support.optional import OptionalPackage

optimize = OptionalPackage("scipy.optimize")

NAMES = (
    *("fk", "configuration", "configuration_D_q", "margin", "constraint"),
    *("chain", "chain_D_q", "chain_rates", "chain_accelerations", "jacobian_mixed_dot"),
    *("actuators", "actuators_D_chain", "actuator_rates", "actuator_accelerations"),
    "jacobian_mixed",
)
ITERATED = ("five_bar",)
"""Names of mechanisms with a coordinate outside the main chain."""
STEP = 1e-6
DRAWN = {
    "five_bar": lambda: out_of_plane(on_links(five_bar()), np.random.default_rng(4)),
}


@pytest.fixture(scope="module", params=list(DRAWN))
def drawn(request, tmp_path_factory):
    """Return a robot whose loops cannot close, and its description.

    The campaign `least_squares` tests other mechanisms and many errors.
    """
    mechanism = DRAWN[request.param]()
    names = (*NAMES, *(["actuator_margin"] if request.param in ITERATED else ()))
    return compiled(mechanism, tmp_path_factory.mktemp("open"), names, ["c"]), mechanism


def configurations(robot, count=40):
    offset = np.random.default_rng(5).uniform(-0.3, 0.3, (count, robot.n))
    q = robot.reference.q + offset
    assert robot.loops_close(q).all()
    return q


def weighted(mechanism):
    """Return a numeric model, and functions for its closure errors (meter) and their derivative."""
    model = Model(mechanism)
    size = float(f"{NumericMechanism(mechanism).size:.3g}")
    weights = []
    for loop_joint in mechanism.loop_joints:
        assert isinstance(loop_joint, Closure)
        assert loop_joint.kind == "pin"
        weights += [1, 1, 1, size, size]
    weights = np.array(weights)
    return (
        model,
        lambda z: model.gaps(z[None])[0] * weights,
        lambda z: model.D_z(z[None])[0] * weights[:, None],
    )


def test_closure_minimizes_weighted_sum_of_squares(drawn):
    robot, mechanism = drawn
    model, gaps, slopes = weighted(mechanism)
    free = model.unknown
    for z in robot.configuration(configurations(robot, 4)):

        def at(x, z=z):
            whole = z.copy()
            whole[free] = x
            return whole

        found = optimize.least_squares(
            lambda x: gaps(at(x)),
            z[free] + 1e-3,
            lambda x: slopes(at(x))[:, free],
            xtol=1e-15,
            ftol=1e-15,
            gtol=1e-15,
        )
        np.testing.assert_allclose(z[free], found.x, atol=1e-9)
        # The least-squares solution does not close the loops exactly, so closure errors remain.
        assert 1e-5 < np.abs(gaps(z)).max() < 0.1


def test_constraint_norm_equals_closure_gaps(drawn):
    robot, mechanism = drawn
    model = Model(mechanism)
    z = robot.configuration(configurations(robot))
    squares = (robot.constraint(z) ** 2).sum(-1)
    np.testing.assert_allclose(squares, (model.gaps(z) ** 2).sum(-1), rtol=1e-9)


def test_fk_matches_independent_model_pose(drawn):
    robot, mechanism = drawn
    q = configurations(robot)
    tip = Model(mechanism).tip(robot.configuration(q))
    np.testing.assert_allclose(robot.fk(q), tip, atol=1e-12)


def test_derivatives_match_finite_differences(drawn):
    robot, _ = drawn
    q = configurations(robot)
    rng = np.random.default_rng(6)
    v, a = rng.uniform(-1, 1, (2, *q.shape))

    def difference(of):
        return (of(q + STEP * v) - of(q - STEP * v)) / (2 * STEP)

    along = np.einsum("Nij,Nj->Ni", robot.configuration_D_q(q), v)
    np.testing.assert_allclose(along, difference(robot.configuration), atol=1e-7)
    moved = difference(lambda q: robot.fk(q)[:, :3, 3])
    linear = np.einsum("Nij,Nj->Ni", robot.jacobian_mixed(q)[:, :3], v)
    np.testing.assert_allclose(linear, moved, atol=1e-7)
    rates = difference(lambda q: robot.chain_rates(q, v))
    found = robot.chain_accelerations(q, v, a)
    np.testing.assert_allclose(found - robot.chain_rates(q, a), rates, atol=1e-6)
    turned = difference(robot.jacobian_mixed)
    np.testing.assert_allclose(robot.jacobian_mixed_dot(q, v), turned, atol=1e-6)


def test_actuator_maps_invert_chain_maps(drawn):
    robot, _ = drawn
    q = configurations(robot)
    rng = np.random.default_rng(7)
    v, a = rng.uniform(-1, 1, (2, *q.shape))
    theta, thetad = robot.chain(q), robot.chain_rates(q, v)
    thetadd = robot.chain_accelerations(q, v, a)
    np.testing.assert_allclose(robot.actuators(theta), q, atol=1e-10)
    np.testing.assert_allclose(robot.actuator_rates(theta, thetad), v, atol=1e-9)
    again = robot.actuator_accelerations(theta, thetad, thetadd)
    np.testing.assert_allclose(again, a, atol=1e-8)
    D = robot.actuators_D_chain(theta) @ robot.chain_D_q(q)
    np.testing.assert_allclose(D, np.broadcast_to(np.eye(robot.n), D.shape), atol=1e-9)
    if "actuator_margin" in robot.functions:
        assert robot.chain_closes(theta).all()
        margin = robot.actuator_margin(robot.chain(robot.reference.q))
        np.testing.assert_allclose(margin, 1.0, atol=1e-5)


def test_closable_loops_keep_closed_form_solution():
    """The option `closure="least squares"` has no effect if the loops can be closed exactly."""
    hybrid = solved(replace(parallelogram(), closure="least squares"))
    assert not hybrid.forward.open


def test_ik_refined_from_nominal_recovers_configuration(tmp_path):
    """A boom whose second motor drives the elbow by a parallelogram with a redundant rod."""
    text = """
name = "driven_elbow"
convention = "urdf"
actuated = ["shoulder", "motor", "wrist"]
closure = "least squares"
tool = { body = "hand", xyz = [0.3, 0, 0] }
[[joints]]
name = "shoulder"
link = "upper"
axis = [0, 0, 1]
[[joints]]
name = "elbow"
link = "fore"
xyz = [1, 0, 0]
axis = [0, 0, 1]
[[joints]]
name = "wrist"
link = "hand"
xyz = [0.8, 0, 0]
axis = [0, 0, 1]
[[joints]]
name = "motor"
parent = "upper"
link = "horn"
axis = [0, 0, 1]
[[rods]]
name = "rod"
length = 1
a = { body = "horn", xyz = [0.2, 0, 0] }
b = { body = "fore", xyz = [0.2, 0, 0] }
[[rods]]
name = "brace"
length = 1.0003
a = { body = "horn", xyz = [0, 0.2, 0] }
b = { body = "fore", xyz = [0, 0.2, 0] }
[reference]
shoulder = 0.4
motor = 0.7
elbow = 0.7
wrist = 0.2
"""
    path = tmp_path / "driven_elbow.toml"
    path.write_text(text)
    functions = ["fk", "fk_jacobian_mixed", "margin", "ik", "constraint"]
    robot = compiled(read(path), tmp_path, functions, ["c"])
    assert robot.loop_solution == "newton"
    q = robot.reference.q + np.random.default_rng(8).uniform(-0.5, 0.5, (200, 3))
    found = robot.ik(robot.fk(q))
    apart = np.where(found.valid[..., None], np.abs(found.q - q[:, None]), np.inf).max(-1)
    assert apart.min(-1).max() < 1e-9
    again = robot.fk(found.q[found.valid])
    np.testing.assert_allclose(again, np.repeat(robot.fk(q), found.valid.sum(-1), 0), atol=1e-10)
