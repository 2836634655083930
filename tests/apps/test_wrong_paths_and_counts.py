"""Arguments that are not a path or a count raise an error that names the argument."""

import re

import numpy as np
import pytest

import chasles
from chasles import InputError, view
from chasles.calibration import Calibration, monte_carlo, read_measurements
from chasles.derive import apply_calibration, check, convert, read, read_text, write
from chasles.study import Workspace, workspace
from chasles.study.motion import MotionSequence, Trajectory

ARM = chasles.load("ur5e")
TRAJECTORY = (
    MotionSequence(ARM, ARM.q_reference).move(ARM.q_reference + 0.1, "quintic", duration=1)
).sample(5)
DESCRIBED = read("scara")
PATHS = {
    "robot": (chasles.load, chasles.find_folder),
    "source": (read, check),
    "text": (read_text,),
    "folder": (lambda path: write(DESCRIBED, path, functions=["fk"], languages=["c"]),),
    "path": (
        lambda path: apply_calibration(DESCRIBED, path),
        convert(DESCRIBED, "toml").save,
        lambda path: Trajectory.load(path, ARM),
        Workspace.load,
        Calibration.load,
        lambda path: read_measurements(path, ARM),
        TRAJECTORY.save,
        TRAJECTORY.to_csv,
        TRAJECTORY.to_npz,
        lambda path: view.write_html(ARM, path),
    ),
    "file": (lambda path: chasles.animate(ARM, TRAJECTORY, path),),
}
COUNTS = {
    "size": ARM.random_q,
    "rng": lambda count: ARM.random_q(3, rng=count),
    "samples": lambda count: workspace(ARM, count, progress=False),
    "resolution": lambda count: workspace(ARM, 10, resolution=count, progress=False),
    "threads": lambda count: workspace(ARM, 10, threads=count, progress=False),
    "fps": lambda fps: chasles.animate(ARM, TRAJECTORY, "motion.gif", fps=fps),
}


@pytest.mark.parametrize("wrong", [None, 3, 2.5, [], b"arm.toml"], ids=repr)
@pytest.mark.parametrize("name", PATHS)
def test_argument_that_is_no_path_is_named(name, wrong):
    for call in PATHS[name]:
        with pytest.raises(InputError, match=rf"\b{name}: expected .*{re.escape(repr(wrong))}"):
            call(wrong)


@pytest.mark.parametrize("wrong", ["a", -1, np.nan, [[1]], 1j], ids=repr)
@pytest.mark.parametrize("name", COUNTS)
def test_argument_that_is_no_count_is_named(name, wrong):
    with pytest.raises(InputError, match=rf"\b{name}\b"):
        COUNTS[name](wrong)


def test_size_and_seed_of_random_configurations():
    assert ARM.random_q((2, 3)).shape == (2, 3, 6)
    assert ARM.random_q(np.int64(2), rng=np.random.default_rng(1)).shape == (2, 6)
    assert not np.array_equal(ARM.random_q(2, rng=None), ARM.random_q(2, rng=None))
    with pytest.raises(InputError, match="size"):
        ARM.random_q(None)
    with pytest.raises(InputError, match="size"):
        ARM.random_q(10**30)


def test_number_of_simulated_arms_is_checked(monkeypatch):
    with pytest.raises(InputError, match="monte_carlo: samples"):
        monte_carlo(ARM, ARM.q_reference, {}, samples="a")
