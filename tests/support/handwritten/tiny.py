"""Handwritten `manifest.json` and C code of a tiny robot, as the compiler would write them."""

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

HEADER = """\
#ifndef TINY_H
#define TINY_H
void tiny_fk(const double q[2], double T[12]);
void tiny_blend(const double q[2], const double A[6], double y[2]);
void tiny_fused(const double q[2], double T[12], double J[4]);
void tiny_distance(const double s[1], const double q[2], double d[1]);
void tiny_wide(const double W[1600], double V[1600]);
#endif
"""

# Like generated C, every kernel writes a part of its output before it reads all inputs.
SOURCE = """\
#include "tiny.h"
#include <math.h>
void tiny_fk(const double q[2], double T[12])
{
    int i;
    for (i = 0; i < 12; i++) T[i] = sin(q[0]) + i * q[1];
}
void tiny_blend(const double q[2], const double A[6], double y[2])
{
    y[0] = q[0] * A[0] + q[1] * A[1] + A[2];
    y[1] = q[0] * A[3] + q[1] * A[4] + A[5];
}
void tiny_fused(const double q[2], double T[12], double J[4])
{
    tiny_fk(q, T);
    J[0] = q[0]; J[1] = q[1]; J[2] = q[0] * q[1]; J[3] = 1.0;
}
void tiny_distance(const double s[1], const double q[2], double d[1])
{
    d[0] = s[0] * sqrt(q[0] * q[0] + q[1] * q[1]);
}
void tiny_wide(const double W[1600], double V[1600])
{
    int i;
    for (i = 0; i < 1600; i++) V[i] = 2.0 * W[1599 - i];
}
"""


def fk(q):
    return (np.sin(q[0]) + np.arange(12) * q[1]).reshape(3, 4)


def blend(q, a):
    return a[:, :2] @ q + a[:, 2]


def argument(name, shape, unit="1"):
    return {"name": name, "shape": list(shape), "unit": unit, "meaning": f"The {name}."}


def function(name, summary, inputs, outputs):
    operations = {"multiply": 4, "add": 3, "negate": 0, "trig": 1, "other": 0, "total": 8}
    return {
        "name": name,
        "symbol": f"tiny_{name}",
        "summary": summary,
        "identity": "Is what it is.",
        "inputs": inputs,
        "outputs": outputs,
        "operations": operations,
        "role": "other",
    }


def manifest():
    """Return the manifest of the tiny robot, without file hashes."""
    q = argument("q", [2], "rad")
    coordinates = [
        {"name": "pan", "kind": "revolute", "unit": "rad", "lower": -3.0, "upper": 3.0},
        {"name": "lift", "kind": "prismatic", "unit": "m", "lower": None, "upper": None},
    ]
    return {
        "chasles": 2,
        "name": "tiny",
        "title": "A tiny robot",
        "kind": "serial",
        "source": "Made up.",
        "coordinates": coordinates,
        "frames": {"base": "base", "tip": "ee", "links": ["link1", "link2"]},
        "notes": ["Not to be built."],
        "parameters": [
            {"name": "d1", "value": 0.1625, "exact": "13/80", "unit": "m", "meaning": "Height."}
        ],
        "functions": [
            function("fk", "Pose of the tool.", [q], [argument("T", [3, 4])]),
            function("blend", "Blends.", [q, argument("A", [2, 3])], [argument("y", [2])]),
            function("fused", "Two.", [q], [argument("T", [3, 4]), argument("J", [2, 2])]),
            function("distance", "Scaled.", [argument("s", []), q], [argument("d", [])]),
            function("wide", "Large.", [argument("W", [40, 40])], [argument("V", [40, 40])]),
        ],
        "tolerances": {"dead_point": 1e-12},
        "description_sha256": "0" * 64,
        "versions": {"casadi": "3.8.2", "sympy": "1.14.0"},
    }


def sha256(text):
    return hashlib.sha256(text.encode()).hexdigest()


@dataclass
class Folder:
    """The folder of a generated robot.

    Tests may corrupt its files.
    """

    path: Path
    manifest: dict
    name: str = "tiny"

    def write(self, source=SOURCE, header=HEADER):
        """Write all files, and store their hashes in the manifest."""
        self.path.mkdir(parents=True, exist_ok=True)
        (self.path / f"{self.name}.c").write_text(source)
        (self.path / f"{self.name}.h").write_text(header)
        files = {f"{self.name}.c": source, f"{self.name}.h": header}
        self.manifest["files"] = {file: sha256(text) for file, text in files.items()}
        self.write_manifest()

    def write_manifest(self):
        """Write only the manifest."""
        (self.path / "manifest.json").write_text(json.dumps(self.manifest))
