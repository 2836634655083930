"""A linear delta with end-stop errors, and its bed contacts in closed form."""

import math

import numpy as np

from chasles.derive import read_text

LINEAR_DELTA = "linear_delta"
END_STOPS = 0.31e-3, -0.22e-3, 0.1e-3
"""Errors of the end stops [m]."""
_COLUMNS, _PLATFORM, _ROD, _WIDTH = 0.127, 0.030, 0.212, 0.020
"""Column radius, platform joint radius, rod length and half the rod spacing (meter)."""
_BED = 0.085
_ANGLES = 210, 330, 90


def description_of(name: str):
    """Return the description of the linear delta robot without geometric errors."""
    lines = [f'name = "{name}"', 'convention = "urdf"', 'actuated = ["a", "b", "c"]']
    lines += ['units = { length = "m", angle = "deg" }', 'tool = { body = "platform" }']
    lines += ["[[joints]]", 'name = "platform"', 'type = "free"', 'link = "platform"']
    for column, angle in zip("abc", _ANGLES, strict=True):
        lines += ["[[joints]]", f'name = "{column}"', 'type = "prismatic"', 'parent = "0"']
        lines += [f'link = "car_{column}"', "axis = [0, 0, 1]", "limits = [0, 0.5]"]
        lines += [f'xyz = ["{_COLUMNS}*cos({angle})", "{_COLUMNS}*sin({angle})", 0]']
        lines += [f"rpy = [0, 0, {angle}]"]
    for column, angle in zip("abc", _ANGLES, strict=True):
        for word, y in (("left", _WIDTH), ("right", -_WIDTH)):
            x_b = f"{_PLATFORM}*cos({angle})-({y})*sin({angle})"
            y_b = f"{_PLATFORM}*sin({angle})+({y})*cos({angle})"
            lines += ["[[rods]]", f'name = "rod_{column}_{word}"', f'length = "{_ROD}"']
            lines += ['ends = "ball"', f'a = {{ body = "car_{column}", xyz = [0, "{y}", 0] }}']
            lines += [f'b = {{ body = "platform", xyz = ["{x_b}", "{y_b}", 0] }}']
    height = math.sqrt(_ROD**2 - (_COLUMNS - _PLATFORM) ** 2)
    lines += ["[reference]", *(f"{column} = {height:.4f}" for column in "abc"), "z = 0"]
    return read_text("\n".join(lines) + "\n")


def bed_contacts(count: int, seed: int, noise: float) -> np.ndarray:
    """Return actuator coordinates (count, 3) of random, noisy contacts of the tool with the bed."""
    rng = np.random.default_rng(seed)
    radius, angle = _BED * np.sqrt(rng.uniform(size=count)), rng.uniform(0, 2 * np.pi, count)
    x, y, z = radius * np.cos(angle), radius * np.sin(angle), noise * rng.normal(size=count)
    at, far = np.radians(_ANGLES), _COLUMNS - _PLATFORM
    apart = (far * np.cos(at) - x[:, None]) ** 2 + (far * np.sin(at) - y[:, None]) ** 2
    return z[:, None] + np.sqrt(_ROD**2 - apart) - np.array(END_STOPS)
