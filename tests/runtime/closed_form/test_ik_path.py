"""Tests `ik_path` on one branch, and error messages of robots without an IK function."""

import itertools

import numpy as np
import pytest

import chasles
from tests.support.handwritten import scara


def load(folder, patch):
    patch.setenv("CHASLES_CACHE", str(folder.path.parent / "cache"))
    return chasles.load(folder.path)


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        return load(scara.write(tmp_path_factory.mktemp("scara") / "scara"), patch)


def line(start, end, m=200):
    return np.asarray(start) + np.linspace(0, 1, m)[:, None] * np.subtract(end, start)


def test_ik_path_recovers_joint_path(arm):
    q = line([-2.0, 0.3, 0.0, 5.0], [2.0, 2.0, 0.4, 30.0], 400)
    path = arm.ik_path(arm.fk(q), q[0] + 0.05)
    assert path.complete
    assert (path.ended_at, path.reason, path.coordinate) == (400, "", "")
    np.testing.assert_allclose(path.q, q, atol=1e-11)
    np.testing.assert_allclose(path.max_step, np.abs(q[1] - q[0]), atol=1e-9)
    margin = arm.ik(arm.fk(q)).margin[:, 0]
    assert path.min_margin == margin.min()
    assert path.min_margin_index == margin.argmin()
    assert str(path).startswith("all 400 poses on one branch, margin 0.0")


@pytest.mark.parametrize("elbow", [1.0, -1.0])
def test_seed_selects_branch_and_winding(arm, elbow):
    q = line([3.0, elbow, 0.0, 0.0], [3.5, 1.5 * elbow, 0.1, 0.5])
    for turn in (0.0, -2 * np.pi):
        seed = q[0] + np.array([turn, 0.1, 0, 7 * turn])
        path = arm.ik_path(arm.fk(q), seed)
        assert path.complete
        np.testing.assert_allclose(path.q, q + np.array([turn, 0, 0, 7 * turn]), atol=1e-10)


def test_path_continues_through_singularity_without_jump(arm):
    # The elbow changes from left to right, so the path moves from the first solution slot to the
    # second.
    q = line([0.0, 0.5, 0.0, 0.0], [0.5, -0.5, 0.0, 0.0], 201)
    path = arm.ik_path(arm.fk(q), q[0])
    assert path.complete
    # The branches meet where the arm is stretched. Beyond the stretched pose, the joint path may
    # follow either branch, but must not jump.
    assert path.max_step.max() < 0.05
    np.testing.assert_allclose(np.abs(path.q[:, 1]), np.abs(q[:, 1]), atol=1e-7)
    assert path.min_margin_index == 100
    assert abs(path.min_margin) < 1e-12


def test_path_ends_at_first_unreachable_pose(arm):
    T = arm.fk(np.zeros((50, 4)))
    T[:, 0, 3] = np.linspace(0.5, 0.8, 50)
    path = arm.ik_path(T, [0.1, 0.5, 0, 0])
    assert not path.complete
    assert path.reason == "no solution"
    assert path.ended_at == np.argmax(T[:, 0, 3] > scara.A1 + scara.A2)
    assert len(path.q) == path.ended_at
    np.testing.assert_allclose(arm.fk(path.q), T[: path.ended_at], atol=1e-12)
    assert str(path) == f"ended at pose {path.ended_at}: no branch reaches it"
    T[3] = np.nan
    assert arm.ik_path(T, np.zeros(4)).ended_at == 3


def test_path_ends_at_joint_limit(arm):
    q = line([0.0, 1.0, 0.0, 0.0], [8.0, 1.0, 0.0, 0.0])
    path = arm.ik_path(arm.fk(q), q[0])
    assert (path.reason, path.coordinate, path.complete) == ("limit", "shoulder", False)
    assert path.ended_at == np.argmax(q[:, 0] > 6.5)
    assert path.next_value == pytest.approx(q[path.ended_at, 0])
    np.testing.assert_allclose(path.q, q[: path.ended_at], atol=1e-11)
    assert "shoulder would go to 6.5" in str(path)
    # If the first pose has no solution within the limits, the path ends at this pose.
    low = arm.ik_path(arm.fk(q + np.array([0, 0, 20, 0])), q[0])
    assert (low.ended_at, low.reason, low.coordinate, low.q.shape) == (0, "limit", "lift", (0, 4))
    assert np.isnan(low.min_margin)
    assert low.min_margin_index == -1
    assert (low.max_step == 0).all()


def test_path_starts_within_joint_limits(arm):
    # The seed adds a full turn to the shoulder angle, which is then outside the joint limits. The
    # solution on the other branch is nearer to the seed.
    q = line([3.0, 1.0, 0.0, 0.0], [3.2, 1.0, 0.0, 0.0])
    path = arm.ik_path(arm.fk(q), q[0] + np.array([2 * np.pi, 0, 0, 0]))
    assert path.complete
    np.testing.assert_allclose(arm.fk(path.q), arm.fk(q), atol=1e-12)
    assert (np.abs(path.q[:, 0]) <= 6.5).all()
    np.testing.assert_allclose(path.q[:, 1], -1.0)


def test_path_ends_before_joint_jump(arm):
    q = np.concatenate([line([0, 1, 0, 0], [0.5, 1, 0, 0], 20), line([1.5, 1, 0, 0], [2, 1, 0, 0])])
    T = arm.fk(q)
    path = arm.ik_path(T, q[0])
    assert (path.ended_at, path.reason, path.coordinate) == (20, "jump", "shoulder")
    assert path.next_value == pytest.approx(1.5)
    assert str(path) == "ended at pose 20: shoulder would jump to 1.5"
    assert arm.ik_path(T, q[0], max_step=1.1).complete
    assert arm.ik_path(T, q[0], max_step=0.01).ended_at == 1


def test_path_stays_near_along_solution_continuum(arm, monkeypatch):
    # If a pose allows a self-motion, the inverse kinematics function may return a solution far from
    # the previous configuration. Newton's method finds a solution near the previous configuration.
    q = line([0.0, 1.0, 0.0, 0.0], [0.5, 1.2, 0.0, 0.0], 30)
    T = arm.fk(q)
    solutions = arm.ik(T)
    far = solutions._replace(q=solutions.q.copy())
    far.q[10] += [2.0, -2.0, 0.0, 0.0]
    monkeypatch.setitem(vars(arm), "functions", {**arm.functions, "ik": lambda *_: far})
    roles = dict(arm._roles)
    monkeypatch.setitem(vars(arm), "_roles", roles)
    path = arm.ik_path(T, q[0])
    assert path.complete
    np.testing.assert_allclose(path.q, q, atol=1e-9)
    roles.pop(("pose and jacobian", "actuators", ""))
    assert arm.ik_path(T, q[0]).reason == "jump"


@pytest.mark.parametrize(
    ("T", "seed", "more", "message"),
    [
        (np.eye(4), np.zeros(4), {}, r"expected T \(m, 4, 4\) and q_seed \(4,\), got shapes"),
        (np.zeros((3, 4, 4)), np.zeros(3), {}, r"q_seed \(4,\)"),
        (np.zeros((3, 4, 4)), np.zeros(4), {"max_step": 0}, "max_step must be positive, got 0"),
        (
            np.zeros((3, 4, 4)),
            np.zeros(4),
            {"max_step": np.nan},
            "must be positive, got nan",
        ),
    ],
    ids=["single pose", "short seed", "zero step", "nan step"],
)
def test_wrong_arguments_are_rejected(arm, T, seed, more, message):
    with pytest.raises(chasles.ChaslesError, match=message):
        arm.ik_path(T, seed, **more)


# ------------------------------------- inputs of inverse kinematics functions


def test_redundancy_parameters_are_reported(arm, tmp_path, cache, monkeypatch):
    assert arm.redundancy == ()
    folder = scara.write(tmp_path / "scara")
    functions = folder.manifest["functions"]
    functions[3]["name"], functions[2]["name"] = "ik", "ik_pose"
    functions[3]["domain"], functions[2]["domain"] = "pose", "task"
    folder.write_manifest()
    redundant = load(folder, monkeypatch)
    assert [(item.name, item.unit) for item in redundant.redundancy] == [("phi", "rad")]


def test_further_inverse_inputs_vary_along_path(tmp_path, cache, monkeypatch):
    folder = scara.write(tmp_path / "scara")
    # A position task leaves the roll of the arm free.
    functions = folder.manifest["functions"]
    source = scara.SOURCE.format(true_a1=scara.A1, nominal_a1=scara.A1, a2=scara.A2)
    source = source.replace(
        "scara_ik(const double T[16],", "scara_ik(const double T[16], const double phi[1],"
    )
    source = source.replace("atan2(T[4], T[0])", "phi[0]")
    header = scara.HEADER.replace(
        "const double T[16], double q[8]", "const double T[16], const double phi[1], double q[8]"
    )
    functions[2]["inputs"].append(functions[3]["inputs"][1])
    folder.write(source, header)
    arm = load(folder, monkeypatch)
    q = line([0.0, 1.0, 0.0, 0.3], [0.5, 1.2, 0.0, 0.9], 30)
    path = arm.ik_path(arm.fk(q), q[0], fixed={"phi": q[:, [0, 1, 3]].sum(-1)})
    np.testing.assert_allclose(path.q, q, atol=1e-12)
    fixed = arm.ik_path(arm.fk(q), q[0], fixed={"phi": 1.3})
    np.testing.assert_allclose(fixed.q[:, [0, 1, 3]].sum(-1), 1.3)
    with pytest.raises(chasles.ShapeError, match=r"got shape \(2,\) for phi"):
        arm.ik_path(arm.fk(q), q[0], fixed={"phi": np.zeros(2)})


def test_missing_inverse_error_states_reason(tmp_path, cache, monkeypatch):
    missing = "no three axes meet or are parallel: the nearest, 2 3 4, are 0.12 m apart"
    folder = scara.write(tmp_path / "scara", inverse={"missing": missing})
    folder.manifest["functions"] = folder.manifest["functions"][:2]
    folder.write_manifest()
    arm = load(folder, monkeypatch)
    for name in ("ik", "ik_path", "ik_position"):
        with pytest.raises(
            AttributeError, match=rf"has no '{name}': {missing}; .*nearest functions"
        ):
            getattr(arm, name)
    with pytest.raises(AttributeError, match=r"has no 'loops_close': its q are its joints"):
        arm.loops_close  # noqa: B018
    with pytest.raises(AttributeError, match="'id'") as error:
        arm.id  # noqa: B018
    # Python needs the attributes ``name`` and ``obj`` of an AttributeError to suggest the most
    # similar name in dir(arm).
    assert (error.value.name, error.value.obj) == ("id", arm)
    assert arm.redundancy == ()
    assert not hasattr(arm, "ik")


@pytest.mark.parametrize(
    "inverse",
    [{"tier": "guessed"}, {"missing": 3}, []],
    ids=["unknown tier", "reason not text", "list"],
)
def test_invalid_inverse_entry_in_manifest_is_rejected(tmp_path, cache, inverse):
    folder = scara.write(tmp_path / "scara", inverse=inverse)
    with pytest.raises(chasles.ManifestError, match="inverse"):
        chasles.load(folder.path)


# --------------------------------------------------------------- shipped robots


@pytest.mark.parametrize("name", ["ur5e", "puma560", "irb6640"])
def test_path_passes_wrist_singularity_without_jump(name):
    arm = chasles.load(name)
    start = np.array([0.3, -0.8, 0.9, -0.4, 0.8, 0.2])
    q = start + np.linspace(0, 1, 401)[:, None] * [0.3, 0.2, -0.1, 0.3, -1.6, 0.4]
    assert abs(q[200, 4]) < 1e-15
    path = arm.ik_path(arm.fk(q), q[0])
    assert path.complete, str(path)
    assert path.max_step.max() < 0.5
    assert np.abs(arm.fk(path.q) - arm.fk(q)).max() < 1e-9
    np.testing.assert_allclose(path.q[[0, 100]], q[[0, 100]], atol=1e-9)


def test_path_follows_windings_beyond_full_turn():
    arm = chasles.load("ur5e")
    start = np.array([-5.0, -1.2, 1.5, -0.4, 0.9, -6.0])
    q = start + np.linspace(0, 1, 500)[:, None] * [9.0, 0.1, 0.1, 0.1, 0.1, 12.0]
    path = arm.ik_path(arm.fk(q), q[0])
    assert path.complete
    np.testing.assert_allclose(path.q, q, atol=1e-10)
    beyond = start + np.linspace(0, 1, 500)[:, None] * [-2.0, 0, 0, 0, 0, 0]
    ended = arm.ik_path(arm.fk(beyond), beyond[0])
    assert (ended.reason, ended.coordinate) == ("limit", arm.coordinates[0].name)
    assert ended.ended_at == np.argmax(beyond[:, 0] < arm.lower[0])


def test_path_of_seven_joint_arm_follows_fixed_joint_values():
    arm = chasles.load("panda")
    start = np.array([0.1, 0.2, 0.3, -1.5, 0.4, 1.6, 0.5])
    q = start + np.linspace(0, 1, 100)[:, None] * [0.3, 0.2, -0.1, 0.3, 0.2, 0.1, 0.4]
    path = arm.ik_path(arm.fk(q), q[0], fixed={"joint7": q[:, 6]})
    assert path.complete
    np.testing.assert_allclose(path.q, q, atol=1e-9)


TASKS = {
    "lynxmotion": ["position", "position_pitch", "position_direction"],
    "bricklaying_planar": ["planar"],
}
STILL = {"position": [3, 4], "position_pitch": [4], "position_direction": [4], "planar": []}
"""Indices of the coordinates that the inverse of each task sets to 0."""


@pytest.mark.parametrize("name", TASKS)
def test_task_paths_recover_random_joint_paths(name):
    robot, rng, kept = chasles.load(name), np.random.default_rng(3), 0
    assert [f"ik_{task}" for task in TASKS[name]] == [
        name for name in robot.functions if name.startswith("ik_")
    ]
    lower, upper = np.maximum(robot.lower, -2.5), np.minimum(robot.upper, 2.5)
    for task in TASKS[name]:
        for _ in range(60):
            q0, turn = rng.uniform(0.15, 0.85, robot.n), rng.uniform(-0.1, 0.1, robot.n)
            q = lower + line(q0, q0 + turn, 60) * (upper - lower)
            q[:, STILL[task]] = 0
            T = robot.fk(q)
            path = robot.ik_path(T, q[0], task=task)
            assert path.complete
            there = robot.fk(path.q)
            np.testing.assert_allclose(there[:, :3, 3], T[:, :3, 3], atol=1e-9)
            if task != "position":
                np.testing.assert_allclose(there[:, 2, 2], T[:, 2, 2], atol=1e-9)
            # The path may change its branch only at poses where branches meet.
            if path.min_margin > 1e-3:
                np.testing.assert_allclose(path.q, q, atol=1e-7)
                kept += 1
    assert kept >= 45 * len(TASKS[name])


def test_five_axis_arm_follows_line_at_constant_pitch():
    robot = chasles.load("lynxmotion")
    q = np.array([0.3, 1.4, -1.2, -0.9, 0.0])
    start = robot.fk(q)
    T = np.broadcast_to(start, (300, 4, 4)).copy()
    T[:, :3, 3] += line([0, 0, 0], [-0.03, 0.04, 0.02], 300)
    # An arm with five axes cannot preserve the complete orientation along the path.
    assert robot.ik_path(T, q).ended_at == 1
    path = robot.ik_path(T, q, task="position_pitch")
    assert path.complete
    there = robot.fk(path.q)
    np.testing.assert_allclose(there[:, :3, 3], T[:, :3, 3], atol=1e-12)
    np.testing.assert_allclose(there[:, 2, 2], start[2, 2], atol=1e-12)
    assert path.max_step.max() < 0.01
    # A path of inputs of ik_position_pitch gives the same joint path as a path of poses.
    pitch = np.arctan2(start[2, 2], np.hypot(*start[:2, 2]))
    x = np.column_stack([T[:, :3, 3], np.full(300, pitch)])
    np.testing.assert_array_equal(robot.ik_path(x, q, task="position_pitch").q, path.q)


def test_task_without_inverse_is_rejected_by_name():
    robot = chasles.load("lynxmotion")
    message = "no inverse for task 'planar'; it has pose, position, position_pitch, position_dir"
    with pytest.raises(chasles.InputValueError, match=message):
        robot.ik_path(np.eye(4)[None], np.zeros(5), task="planar")
    with pytest.raises(
        chasles.InputValueError, match="no inverse for task 'position'; it has pose"
    ):
        chasles.load("ur5e").ik_path(np.eye(4)[None], np.zeros(6), task="position")
    with pytest.raises(chasles.ShapeError, match=r"T \(m, 4, 4\) or \(m, 4\) and q_seed \(5,\)"):
        robot.ik_path(np.zeros((3, 5)), np.zeros(5), task="position_pitch")


@pytest.mark.parametrize("name", ["ur5e", "puma560", "irb6640", "stanford", "excavator"])
def test_batched_path_equals_sequential_steps(name):
    """The paths are random walks that cross branches, full turns and limits."""
    robot, rng, reasons = chasles.load(name), np.random.default_rng(5), []
    lower, upper = np.maximum(robot.lower, -7), np.minimum(robot.upper, 7)
    for k in range(24):
        drift = rng.normal(0, (0.004, 0.04, 0.08)[k % 3], robot.n)
        steps = drift + rng.normal(0, 0.02, (60, robot.n))
        q = lower + (upper - lower) * rng.random(robot.n) + np.cumsum(steps, axis=0)
        T = robot.fk(q)
        q, T = q[np.isfinite(T).all((1, 2))], T[np.isfinite(T).all((1, 2))]
        if len(q) < 2:
            continue
        path = robot.ik_path(T, q[0])
        here = path.q[:1]
        for pair in itertools.pairwise(T):
            if not len(here) or len(here) > path.ended_at:
                break
            found = robot.ik_path(pair, here[-1])
            if not found.complete:
                assert (found.reason, found.coordinate) == (path.reason, path.coordinate)
                break
            here = np.vstack([here, found.q[1]])
        np.testing.assert_allclose(path.q, here, atol=1e-11)
        reasons.append(path.reason)
    assert len(reasons) > 10
    assert "limit" in reasons


def test_redundancy_improves_its_objective_along_a_path():
    arm = chasles.load("iiwa14")
    start = np.concatenate([[2.5], arm.q_reference[1:]])
    T = np.repeat(arm.fk(start)[None], 12, 0)
    T[:, 1, 3] += np.linspace(0, 0.1, 12)
    middle, half = (arm.lower + arm.upper) / 2, (arm.upper - arm.lower) / 2
    objectives = {
        "nearest": lambda q: -np.abs(np.diff(q, axis=0)).max(),
        "limits": lambda q: -(np.abs(q[-1] - middle) / half).max(),
        "manipulability": lambda q: arm.manipulability(q[-1]).measure,
    }
    fixed = arm.ik_path(T, start)
    for name, objective in objectives.items():
        path = arm.ik_path(T, start, redundancy=name)
        assert path.complete
        np.testing.assert_allclose(arm.fk(path.q), T, atol=1e-9)
        assert objective(path.q) > objective(fixed.q)
    few = arm.ik_path(T, start, redundancy="limits", max_step=0.05)
    assert few.complete
    assert few.max_step.max() <= 0.05


def test_redundancy_states_the_end_of_a_path():
    arm = chasles.load("iiwa14")
    T = np.repeat(arm.fk(arm.q_reference)[None], 3, 0)
    T[1, 2, 3] -= 0.1
    T[2, 2, 3] += 5.0
    path = arm.ik_path(T, arm.q_reference, redundancy="nearest", max_step=0.01)
    assert (path.ended_at, path.reason) == (1, "jump")
    assert path.coordinate in arm.coordinate_names
    path = arm.ik_path(T, arm.q_reference, redundancy="nearest")
    assert (path.ended_at, path.reason) == (2, "no solution")
    with pytest.raises(chasles.InputValueError, match="resolve_redundancy of chasles"):
        arm.ik_path(T, arm.q_reference, redundancy="global")
    own = {item.name: None for item in arm.redundancy}
    kept = arm.ik_path(T[:2], arm.q_reference, fixed=[*own], redundancy="limits")
    np.testing.assert_array_equal(kept.q, arm.ik_path(T[:2], arm.q_reference).q)
