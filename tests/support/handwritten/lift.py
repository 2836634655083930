"""Handwritten robot with a waist and a cylinder-driven boom: the smallest robot with a loop.

The boom joint and the two cylinder ends are the corners of a triangle. One side of the triangle is
the cylinder, and two sides are 1 m long. The function ``chain`` returns the waist angle theta1, and
the boom angle theta2 with cos(theta2) = 1 - cylinder^2 / 2.
"""

import json
from pathlib import Path

from tests.support.handwritten.tiny import argument, sha256

HEADER = """\
#ifndef LIFT_H
#define LIFT_H
void lift_chain(const double q[2], double theta[2]);
void lift_chain_rates(const double q[2], const double qd[2], double thetad[2]);
void lift_margin(const double q[2], double margin[2]);
void lift_reach(const double q[2], double x[1], double y[1]);
void lift_actuators(const double theta[2], double q[2]);
void lift_actuator_margin(const double theta[2], double margin[1]);
void lift_chain_all(const double q[2], double theta[4], double margin[2]);
void lift_plain(const double q[2], double theta[2]);
#endif
"""
SOURCE = """\
#include "lift.h"
#include <math.h>
static double cosine(double l) { return 1.0 - l * l / 2.0; }
static double turn(double l) { double c = cosine(l); return atan2(sqrt((1.0 - c) * (1.0 + c)), c); }
void lift_chain(const double q[2], double theta[2])
{
    double second = turn(q[1]);
    theta[0] = q[0]; theta[1] = second;
}
void lift_plain(const double q[2], double theta[2]) { lift_chain(q, theta); }
void lift_chain_rates(const double q[2], const double qd[2], double thetad[2])
{
    double c = cosine(q[1]), rate = q[1] * qd[1] / sqrt((1.0 - c) * (1.0 + c));
    thetad[0] = qd[0]; thetad[1] = rate;
}
void lift_margin(const double q[2], double margin[2])
{
    double c = cosine(q[1]);
    margin[0] = 1.0; margin[1] = (1.0 - c) * (1.0 + c);
}
void lift_reach(const double q[2], double x[1], double y[1])
{
    double t = turn(q[1]), w = q[0];
    x[0] = cos(w) * cos(t); y[0] = sin(w) * cos(t);
}
void lift_actuators(const double theta[2], double q[2])
{
    double t = theta[1], w = theta[0];
    q[0] = w; q[1] = t > 0 ? sqrt(2.0 - 2.0 * cos(t)) : sqrt(t - 1.0 - t);
}
void lift_actuator_margin(const double theta[2], double margin[1]) { margin[0] = sin(theta[1]); }
void lift_chain_all(const double q[2], double theta[4], double margin[2])
{
    double c = cosine(q[1]), t = turn(q[1]), w = q[0];
    theta[0] = w; theta[1] = t; theta[2] = w; theta[3] = -t;
    margin[0] = margin[1] = (1.0 - c) * (1.0 + c);
}
"""


def manifest():
    """Return the manifest of the lift."""
    q, theta = argument("q", [2], "rad or m"), argument("theta", [2], "rad")
    margin, two = argument("margin", [2]), argument("theta", [2, 2])

    def function(name, inputs, outputs, role=("other", "", ""), **more):
        return {
            "name": name,
            "symbol": f"lift_{name}",
            "summary": f"{name}.",
            "inputs": inputs,
            "outputs": outputs,
            "operations": {"total": 20},
            "role": role[0],
            "domain": role[1],
            "codomain": role[2],
            **more,
        }

    def joint(name, kind, unit):
        return {"name": name, "kind": kind, "unit": unit, "lower": None, "upper": None}

    steps = ["lower_triangle", "boom_cylinder"]
    reach = [argument("x", [], "m"), argument("y", [], "m")]
    return {
        "chasles": 2,
        "name": "lift",
        "title": "A lift",
        "kind": "hybrid",
        "source": "Made up.",
        "coordinates": [
            joint("waist", "revolute", "rad"),
            joint("boom_cylinder", "prismatic", "m"),
        ],
        "chain": [joint("theta1", "revolute", "rad"), joint("theta2", "revolute", "rad")],
        "passive": [{"name": "swing", "unit": "rad"}],
        "configuration": [
            {"name": name, "unit": unit}
            for name, unit in (("theta1", "rad"), ("theta2", "rad"), ("boom_cylinder", "m"))
        ],
        "loops": ["boom_cylinder"],
        "reference": {"q": [0.0, 1.0], "z": [0.0, 1.0471975511965976, 1.0]},
        "actuated_in_z": [{"index": 0, "ratio": 1.0}, {"index": 2, "ratio": 1.0}],
        "solution": "closed form",
        "frames": {"base": "base", "tip": "ee", "links": ["post", "boom"]},
        "parameters": [],
        "tolerances": {"dead_point": 1e-12},
        "functions": [
            function("chain", [q], [theta], ("map", "actuators", "chain"), margin="margin"),
            function(
                "chain_rates", [q, argument("qd", [2])], [argument("thetad", [2])], margin="margin"
            ),
            function("margin", [q], [margin], ("margin", "actuators", ""), steps=steps),
            function("reach", [q], reach, margin="margin"),
            function(
                "actuators",
                [theta],
                [q],
                ("map", "chain", "actuators"),
                margin="actuator_margin",
            ),
            function(
                "actuator_margin",
                [theta],
                [argument("margin", [1])],
                ("margin", "chain", ""),
                steps=steps[1:],
            ),
            function(
                "chain_all",
                [q],
                [two, margin],
                ("branches", "actuators", "chain"),
                labels=["lower_triangle left", "lower_triangle right"],
            ),
            function("plain", [q], [theta]),
        ],
    }


def write(folder: Path, content=None):
    content = content or manifest()
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "lift.c").write_text(SOURCE)
    (folder / "lift.h").write_text(HEADER)
    content["files"] = {"lift.c": sha256(SOURCE), "lift.h": sha256(HEADER)}
    (folder / "manifest.json").write_text(json.dumps(content))
    return folder
