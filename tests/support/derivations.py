"""Reads and derives the shipped robots once for all tests."""

import tomllib
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy as np

import chasles.derive
from chasles.derive import Derivation, derive, read
from chasles.derive.description.mechanism_file import has_loops
from chasles.derive.latex import fragments
from chasles.derive.model.mechanism import Described
from chasles.derive.program.programs import Programs, programs
from chasles.derive.terms.branches import patterns
from chasles.derive.terms.casadi_graph import lower

ROBOTS = Path(chasles.derive.__file__).parent / "robots"
GENERATED = Path(chasles.derive.__file__).parent.parent / "generated"
ALL = sorted(path.stem for path in ROBOTS.glob("*.toml"))
"""Names of all shipped robots."""
MECHANISMS = [
    name for name in ALL if has_loops(tomllib.loads((ROBOTS / f"{name}.toml").read_text()))
]
"""Names of the shipped robots with loops."""
NAMES = [name for name in ALL if name not in MECHANISMS]
"""Names of the shipped serial robots."""
SAMPLE = (
    *("ur5e", "jaco2", "iiwa14", "lynxmotion", "bricklaying_planar"),
    *("five_bar", "well_manipulator", "planar_3rrr", "stewart_gough"),
)
"""Shipped robots of every kind, which together have every function that any shipped robot has."""

FULL = ("ur5e", "iiwa14", "lynxmotion", "scara", "five_bar", "planar_3rrr")
"""Robots of the main kinds, for tests of all functions. The derivation of each robot takes about a
second."""


def description(name: str) -> Path:
    """Return the path of a robot file.

    For a name that no shipped robot has, the returned path is in the folder ``shelf/``.
    """
    own = ROBOTS / f"{name}.toml"
    return own if own.is_file() else ROBOTS / "shelf" / own.name


@cache
def robot_of(name: str) -> Described:
    return read(description(name))


@cache
def derivation(name: str) -> Derivation:
    return derive(robot_of(name))


@cache
def article(name: str) -> Mapping[str, str]:
    """Return the fragments of a shipped robot's LaTeX article, keyed by file name."""
    return fragments(derivation(name))


@cache
def committed(name: str) -> Mapping[str, str]:
    return {path.name: path.read_text() for path in (GENERATED / name / "latex").iterdir()}


@cache
def kernels(name: str) -> dict:
    """Return the CasADi functions of a shipped robot, keyed by name."""
    derived = derivation(name)
    names = [function.name for function in derived.functions]
    return dict(zip(names, lower(derived.functions, name), strict=True))


def every_branch(function, kernel, *arguments) -> list[np.ndarray]:
    """Return each output of a CasADi function, flattened and concatenated over all branches."""
    if not function.signs:
        return [np.array(output).ravel() for output in kernel(*arguments)]
    found = [kernel(*arguments, signs) for signs in patterns(function)]
    return [np.concatenate([np.array(x).ravel() for x in xs]) for xs in zip(*found, strict=True)]


@cache
def made(name: str) -> Programs:
    return programs(derivation(name).functions, name)


def shaped(name: str, function: str, *arguments) -> np.ndarray:
    """Return the single output of a CasADi function in the shape that the derivation declares."""
    (result,) = derivation(name).function(function).outputs
    return np.array(kernels(name)[function](*arguments)).reshape(result.shape)
