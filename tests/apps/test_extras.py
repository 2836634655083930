"""An error names the pip command of a missing optional package."""

import builtins
import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import chasles
from chasles import NotInstalledError
from chasles.contract import requires
from chasles.drawing import skeleton
from chasles.study import reach
from chasles.study.motion import Motion, joint_line, spline, time_optimal, time_scaling
from chasles.study.planning import occupancy_map, prm, rrt_connect, sphere
from chasles.view import LiveView
from chasles.view.meshes import body_meshes

Q = np.array([0.3, 0.5, 0.1, 0.2])


@pytest.fixture
def hide(monkeypatch):
    """Make an import fail as if the package were absent."""
    real = builtins.__import__

    def hidden(package):
        def absent(name, *args, **kwargs):
            if name.partition(".")[0] == package:
                raise ModuleNotFoundError(f"No module named {name!r}", name=name)
            return real(name, *args, **kwargs)

        monkeypatch.setattr(builtins, "__import__", absent)

    return hidden


def robot():
    return chasles.load("scara")


def free_map():
    return occupancy_map(np.zeros((3, 3), dtype=bool))


def motion():
    curve = joint_line(Q, Q + 0.1)
    return Motion(robot(), curve, time_scaling("quintic", curve.length, duration=1.0), Q)


CALLS = {
    "scipy": ("'chasles[study]'", lambda _: spline(np.tile(np.eye(4), (3, 1, 1)))),
    "ruckig": ("'chasles[study]'", lambda _: time_scaling("s_curve", 1, duration=1)),
    "toppra": (
        "'chasles[study]'",
        lambda _: time_optimal(motion(), rate_limits=1, acceleration_limits=1),
    ),
    "networkx": ("'chasles[study]'", lambda _: prm(free_map(), 2).plan([1, 1], [2, 2])),
    "coal": ("'chasles[planning]'", lambda _: sphere((0, 0, 0), 1)),
    "ompl": ("'chasles[planning]'", lambda _: rrt_connect(free_map(), [1, 1], [2, 2])),
    "distributed": (
        "'chasles[cluster]'",
        lambda _: reach(robot(), [[0.3, 0.3, 0.0]], client=object()),
    ),
    "matplotlib": ("'chasles[draw]'", lambda _: chasles.draw(robot(), Q)),
    "PIL": (
        "'chasles[draw]'",
        lambda folder: chasles.animate(robot(), Q[None], folder / "a.gif"),
    ),
    "viser": ("'chasles[view]'", lambda _: LiveView(robot())),
    "yourdfpy": (
        "'chasles[view]'",
        lambda folder: body_meshes(folder / "a.urdf", skeleton(robot())),
    ),
}


@pytest.mark.parametrize("package", CALLS)
def test_missing_package_is_named_with_its_pip_command(package, hide, tmp_path):
    distribution, call = CALLS[package]
    hide(package)
    with pytest.raises(NotInstalledError) as caught:
        call(tmp_path)
    assert str(caught.value) == f"{package} is not installed: pip install {distribution}"
    assert caught.value.name == package


@pytest.mark.parametrize("package", ["scipy", "threadpoolctl"])
def test_import_of_calibration_names_the_pip_command(package, hide, monkeypatch):
    for name in [n for n in sys.modules if n.startswith("chasles.calibration")]:
        monkeypatch.delitem(sys.modules, name)
    hide(package)
    expected = rf"^{package} is not installed: pip install 'chasles\[calibration\]'$"
    with pytest.raises(NotInstalledError, match=expected):
        import_module("chasles.calibration")


def test_missing_module_of_chasles_stays_a_fault():
    with pytest.raises(ModuleNotFoundError), requires("chasles[study]"):
        import_module("chasles.absent")


def test_readme_installs_all_extras():
    text = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    assert "pip install '.[all]'" in text.partition("## Install")[2].partition("\n## ")[0]
