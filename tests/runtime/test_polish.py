"""Newton's iteration on forward kinematics, and the inverse of calibrated arms that rests on it."""

import pickle

import numpy as np
import pytest

import chasles
from chasles.polish import PolishedInverse, PolishedSolutions, polish
from chasles.solutions import Solutions, solutions_of

from . import scara

LONGER = 0.003
"""Metres by which the true upper arm is longer than the nominal one."""
SIX = ["ur5e", "puma560"]


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    path = tmp_path_factory.mktemp("calibrated") / "scara"
    folder = scara.write(path, scara.A1 + LONGER, inverse={"tier": "snapped"})
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CHASLES_CACHE", str(path.parent / "cache"))
        return chasles.load(folder.path)


def reachable(n, seed=0):
    rng = np.random.default_rng(seed)
    return rng.uniform([-3, 0.2, -0.5, -3], [3, 2.4, 0.5, 3], (n, 4))


def error(robot, q, T):
    """The larger of distance and angle, computed otherwise: the angle by the chord."""
    here = robot.fk(q)
    linear = np.linalg.norm(here[..., :3, 3] - T[..., :3, 3], axis=-1)
    chord = np.linalg.norm(here[..., :3, :3] - T[..., :3, :3], axis=(-2, -1))
    return np.maximum(linear, 2 * np.arcsin(np.minimum(chord / 8**0.5, 1)))


# -------------------------------------------------------------------- polish


@pytest.mark.parametrize("name", [*SIX, "panda", "stanford", "scara"])
def test_from_nearby_to_the_pose(name):
    robot = chasles.load(name)
    rng = np.random.default_rng(1)
    q = rng.uniform(-1, 1, (500, robot.n)) + 0.3
    T = robot.fk(q)
    found, residual = polish(robot, T, q + rng.uniform(-5e-3, 5e-3, q.shape))
    assert (residual < 1e-9).mean() > 0.99
    good = residual < 1e-9
    assert np.median(residual) < 1e-14
    np.testing.assert_allclose(residual[good], error(robot, found, T)[good], atol=1e-12)
    if robot.n <= 6:
        assert np.median(np.abs(found - q).max(-1)) < 1e-12


def test_large_angles():
    # The angle of the residual where sine and cosine alone would lose it: near pi and near 0.
    robot = chasles.load("ur5e")
    q = np.array([0.3, -1.0, 1.2, 0.4, 0.8, 0.1])
    turned = q + np.array([0, 0, 0, 0, 0, 1.0])[:, None].T * np.array([[np.pi - 1e-3], [1e-7], [2]])
    from chasles.polish import _twist

    twist, residual = _twist(robot.fk(turned), np.broadcast_to(robot.fk(q), (3, 4, 4)))
    np.testing.assert_allclose(residual, [np.pi - 1e-3, 1e-7, 2], atol=1e-14)
    axis = robot.fk(q)[:3, 2]
    np.testing.assert_allclose(twist[3:].T, -residual[:, None] * axis, atol=1e-12)


def test_a_step_solves_the_normal_equations():
    from chasles.polish import _step

    rng = np.random.default_rng(2)
    for n in (4, 6, 7):
        J, e = rng.normal(size=(50, 6, n)), rng.normal(size=(6, 50)) * 1e-2
        damping = (e * e).sum(0)[:, None, None]
        expected = J.mT @ np.linalg.solve(J @ J.mT + damping * np.eye(6), e.T[..., None])
        largest = np.abs(expected).max((1, 2))
        assert (largest < 0.3).any()
        scale = 0.3 / np.maximum(largest, 0.3)
        np.testing.assert_allclose(_step(J, e, 1.0), scale[:, None] * expected[..., 0], atol=1e-10)


def test_slots_share_their_pose(arm):
    q = reachable(40).reshape(2, 20, 4)
    T = arm.fk(q)
    starts = q[..., None, :] + np.linspace(-1e-3, 1e-3, 5)[:, None]
    found, residual = polish(arm, T[..., None, :, :], starts)
    assert found.shape == (2, 20, 5, 4)
    assert residual.shape == (2, 20, 5)
    np.testing.assert_allclose(found, np.broadcast_to(q[..., None, :], found.shape), atol=1e-12)
    one = polish(arm, T[0, 0], starts[0, 0, 0])
    assert one.q.shape == (4,)
    assert float(one.residual) < 1e-14


def test_many_blocks_give_what_one_gives(arm):
    q = reachable(10_000)
    T = arm.fk(q)
    residual = polish(arm, T, q + 1e-3).residual
    assert residual.max() < 1e-13
    np.testing.assert_array_equal(polish(arm, T[9000:], q[9000:] + 1e-3).residual < 1e-13, True)


def test_it_never_gets_worse(arm):
    q = reachable(2000)
    T = arm.fk(q)
    T[:, :2, 3] *= np.random.default_rng(3).uniform(0.2, 4.0, (2000, 1))
    start = q + np.random.default_rng(5).uniform(-1.0, 1.0, q.shape)
    before = error(arm, start, T)
    found, residual = polish(arm, T, start)
    assert (residual <= before + 1e-12).all()
    np.testing.assert_allclose(residual, error(arm, found, T), atol=1e-12)
    assert 0.02 < (residual < 1e-9).mean() < 0.9


def test_at_a_singularity():
    robot = chasles.load("ur5e")
    rng = np.random.default_rng(4)
    q = rng.uniform(-1.5, 1.5, (300, 6))
    q[:, 4] = 0.0
    found, residual = polish(robot, robot.fk(q), q + rng.uniform(-1e-3, 1e-3, q.shape))
    assert (residual < 1e-9).mean() > 0.9
    assert np.abs(found - q).max() < 1.0


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_not_finite(arm, bad):
    q = reachable(3)
    T = arm.fk(q)
    T[1, 0, 3] = bad
    q[2, 1] = bad
    found, residual = polish(arm, T, q)
    assert np.isnan(residual[2])
    assert np.isnan(found[2]).all()
    assert not residual[1] < 1e-9
    assert residual[0] < 1e-14
    none = polish(arm, T[:0], q[:0])
    assert (none.q.shape, none.residual.shape) == ((0, 4), (0,))


def test_wrong_shapes(arm):
    with pytest.raises(chasles.ShapeError, match=r"poses \(..., 4, 4\) and coordinates \(..., 4\)"):
        polish(arm, np.eye(3), np.zeros(4))
    with pytest.raises(chasles.ShapeError, match="do not broadcast"):
        polish(arm, np.zeros((3, 4, 4)), np.zeros((2, 4)))


# ------------------------------------------------------------ calibrated arms


def test_the_true_arm_is_reached(arm):
    q = reachable(500)
    T = arm.fk(q)
    solutions = arm.ik(T)
    assert isinstance(solutions, PolishedSolutions)
    assert isinstance(solutions, Solutions)
    assert solutions.valid.all()
    assert (solutions.residual < 1e-13).all()
    assert (solutions.nominal_residual < 1e-13).all()
    assert (solutions.lost == 0).all()
    assert np.abs(arm.fk(solutions.q) - T[:, None]).max() < 1e-13
    apart = solutions.q[:, 0] - q
    apart[:, [0, 1, 3]] -= 2 * np.pi * np.round(apart[:, [0, 1, 3]] / (2 * np.pi))
    np.testing.assert_allclose(apart, 0, atol=1e-11)
    single = arm.ik(T[0])
    assert single.lost == 0
    np.testing.assert_allclose(single.q, solutions.q[0], atol=1e-12)


def test_lost_branches_are_counted(arm):
    # Folded onto itself the nominal arm comes nearer to its base than the true one, which is
    # longer: within a millimetre of 0.1 m, the nominal arm's border, it reaches nothing.
    T = arm.fk(reachable(4))
    T[:2, :2, 3] = [[0.1005, 0.0], [0.1015, 0.0]]
    solutions = arm.ik(T)
    np.testing.assert_array_equal(solutions.lost, [2, 2, 0, 0])
    assert not solutions.valid[:2].any()
    assert (solutions.nominal_residual[:2] < 1e-9).all()
    assert (solutions.residual[:2] > 1e-3).all()
    # And where only the true arm reaches, it is found from the nominal least-squares answer.
    T[0, :2, 3] = [0.701, 0.0]
    found = arm.ik(T[0])
    assert (found.nominal_residual > 1e-4).all()
    assert found.valid.all()
    assert found.distinct().count == 2


def test_filters_keep_what_belongs_to_the_slots(arm):
    q = reachable(20)
    T = arm.fk(q)
    T[3, 0, 3] = 3.0
    solutions = arm.ik(T)
    wound = solutions.within_limits()
    assert wound.nominal_residual.shape == wound.residual.shape
    np.testing.assert_array_equal(wound.lost, solutions.lost)
    back = wound.sorted_from(q)
    assert isinstance(back.distinct(), PolishedSolutions)
    assert back.nearest(q).shape == (20, 4)
    row, slot = np.nonzero(back.residual == back.residual[3, 0])
    np.testing.assert_array_equal(back.nominal_residual[row, slot], back.nominal_residual[3, 0])
    one = wound.at(3)
    assert one.nominal_residual.shape == (wound.q.shape[1],)
    assert one.least_squares().residual > 1
    again = pickle.loads(pickle.dumps(wound))
    assert type(again) is type(wound)
    np.testing.assert_array_equal(again.nominal_residual, wound.nominal_residual)


def test_out_threads_and_names(arm):
    T = arm.fk(reachable(30))
    out = np.empty((30, 2, 4)), np.empty((30, 2)), np.empty((30, 2))
    solutions = arm.ik(T=T, out=out, threads=2)
    assert all(field is array for field, array in zip(solutions, out, strict=False))
    np.testing.assert_array_equal(solutions.q, arm.ik(T).q)
    assert solutions.valid.all()
    np.testing.assert_array_equal(arm.ik(T.tolist()).q, solutions.q)
    assert "nominal_residual" in arm.ik.__doc__
    assert repr(arm.ik) == "<chasles function scara.ik(T, *, out=None, threads=1), polished>"
    with pytest.raises(chasles.ShapeError, match="T must end in 4 x 4 values"):
        arm.ik(np.eye(3))


class Shifted:
    """An inverse whose answers are a milliradian off, but for what it is given."""

    def __init__(self, inverse):
        self.inverse = inverse

    def __getattr__(self, name):
        return getattr(self.inverse, name)

    def __call__(self, T, q7, **options):
        exact = self.inverse(T, q7, **options)
        exact.q[..., :6] += 1e-3
        return exact


def test_a_joint_that_is_given_keeps_its_value():
    panda = chasles.load("panda")
    q = np.array([0.1, 0.2, 0.3, -1.5, 0.4, 1.6, 0.5]) + np.linspace(0, 0.3, 20)[:, None]
    kind = solutions_of(panda.coordinates, (True,) * 7, PolishedSolutions)
    ik = PolishedInverse(Shifted(panda.ik), panda.fk_jacobian_mixed, kind, ())
    solutions = ik(panda.fk(q), q[:, 6])
    assert (solutions.count >= 2).all()
    given = np.broadcast_to(q[:, None, 6], solutions.valid.shape)
    np.testing.assert_array_equal(solutions.q[..., 6], given)
    found = np.abs(solutions.q - q[:, None]).max(-1)
    assert found.min(-1).max() < 1e-9


def test_not_finite_pose_gives_nan(arm):
    solutions = arm.ik(np.full((2, 4, 4), np.nan))
    assert not solutions.valid.any()
    assert np.isnan(solutions.q).all()
    assert (solutions.lost == 0).all()


def test_pickle(arm):
    assert isinstance(pickle.loads(pickle.dumps(arm.ik)), type(arm.ik))
    assert pickle.loads(pickle.dumps(arm)) == arm


def test_dask_is_refused(arm):
    array = pytest.importorskip("dask.array")
    with pytest.raises(chasles.InputError, match="iterates on NumPy arrays"):
        arm.ik(array.from_array(arm.fk(reachable(4))))


def test_a_calibrated_arm_needs_its_jacobian(tmp_path, cache):
    folder = scara.write(tmp_path / "scara", inverse={"tier": "snapped"})
    del folder.manifest["functions"][1]
    folder.write_manifest()
    with pytest.raises(chasles.ManifestError, match=r"inverse\.tier: .*fk_jacobian_mixed"):
        chasles.load(folder.path)
