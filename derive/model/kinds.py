"""Kinds of joints and of parameters."""

from typing import Literal

JointKind = Literal["revolute", "prismatic", "helical", "fixed"]
"""Motion of a joint: rotation about z, translation along z, both in proportion, or none."""
ParameterKind = Literal["length", "angle", "ratio", "mass"]
UNITS: dict[ParameterKind, str] = {"length": "m", "angle": "rad", "ratio": "1", "mass": "kg"}
"""Unit of each kind of parameter."""
