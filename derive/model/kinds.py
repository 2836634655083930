"""Kinds of joints and of parameters."""

from typing import Literal

JointKind = Literal["revolute", "prismatic", "helical", "fixed"]
"""What a joint lets its link do: turn about z, slide along z, both in proportion, or nothing."""
ParameterKind = Literal["length", "angle", "ratio"]
UNITS: dict[ParameterKind, str] = {"length": "m", "angle": "rad", "ratio": "1"}
"""Unit of each kind of parameter."""
