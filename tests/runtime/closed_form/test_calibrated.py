"""The inverse of calibrated arms: that of a nominal arm, and Newton's iteration."""

import pickle

import numpy as np
import pytest

import chasles
from chasles.closed_form.calibrated import PolishedInverse, PolishedSolutions
from chasles.closed_form.solutions import Solutions, solutions_of

from .. import scara

LONGER = 0.003
"""Metres by which the true upper arm is longer than the nominal one."""


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
    kind = solutions_of(panda.coordinates, (True,) * 7, (), PolishedSolutions)
    ik = PolishedInverse(Shifted(panda.ik), panda.fk_jacobian_mixed, kind, (), (6,), 0.05)
    solutions = ik(panda.fk(q), q[:, 6])
    assert (solutions.count >= 2).all()
    given = np.broadcast_to(q[:, None, 6], solutions.valid.shape)
    np.testing.assert_array_equal(solutions.q[..., 6], given)
    found = np.abs(solutions.q - q[:, None]).max(-1)
    assert found.min(-1).max() < 1e-9


class Perturbed:
    """A UR5e whose axes are a milliradian and a millimetre off, in NumPy, by its screw axes."""

    def __init__(self, size):
        rng = np.random.default_rng(11)
        self.arm = chasles.load("ur5e")
        self.inputs = self.arm.fk.inputs
        self.S, self.M = self.arm.jacobian_space(np.zeros(6)), self.arm.fk(np.zeros(6))
        self.errors = [motion(*rng.uniform(-size, size, (2, 3)), 1.0) for _ in range(7)]

    def __call__(self, q):
        T, lines = np.broadcast_to(self.errors[0], (len(q), 4, 4)), []
        for i, (v, w) in enumerate(zip(self.S[:3].T, self.S[3:].T, strict=True)):
            axis, point = T[:, :3, :3] @ w, T[:, :3, :3] @ np.cross(w, v) + T[:, :3, 3]
            lines.append((axis, point))
            T = T @ motion(v, w, q[:, i, None, None]) @ self.errors[i + 1]
        T = T @ self.M
        columns = [np.hstack([np.cross(w, T[:, :3, 3] - p), w]) for w, p in lines]
        return T, np.stack(columns, -1)


def motion(v, w, angle):
    """Exponential of a twist: w of any length, angle a number or (N, 1, 1)."""
    size = np.linalg.norm(w) or 1.0
    K, a = np.cross(w / size, np.eye(3)).T, np.asarray(angle) * size
    R = np.eye(3) + np.sin(a) * K + (1 - np.cos(a)) * (K @ K)
    T = np.zeros((*R.shape[:-2], 4, 4))
    T[..., :3, :3], T[..., 3, 3] = R, 1.0
    T[..., :3, 3] = (a * np.eye(3) + (1 - np.cos(a)) * K + (a - np.sin(a)) * (K @ K)) @ v / size
    return T


def test_the_perturbed_arm_is_one():
    true, q = Perturbed(0.0), np.random.default_rng(0).uniform(-3, 3, (20, 6))
    for found, expected in zip(true(q), true.arm.fk_jacobian_mixed(q), strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-13)


@pytest.mark.parametrize("size", [1e-4, 1e-3])
@pytest.mark.parametrize(("joint", "value"), [(None, 0), (2, 0.0), (2, 1e-3), (4, 1e-2)])
def test_no_reachable_pose_is_missed(size, joint, value):
    true = Perturbed(size)
    kind = solutions_of(true.arm.coordinates, (True,) * 6, (), PolishedSolutions)
    ik = PolishedInverse(true.arm.ik, true, kind, (), (), 0.05)
    q = np.random.default_rng(12).uniform(-np.pi, np.pi, (500, 6))
    if joint is not None:
        q[:, joint] = value
    T = true(q)[0]
    solutions = ik(T)
    assert (solutions.count > 0).all()
    reached = np.broadcast_to(T[:, None], (500, 8, 4, 4))[solutions.valid]
    assert np.abs(true(solutions.q[solutions.valid])[0] - reached).max() < 2e-9
    found = np.abs(solutions.moves_from(q)).max(-1).min(-1) < 1e-6
    assert joint is not None or found.mean() > 0.98


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
