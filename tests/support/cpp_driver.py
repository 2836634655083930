"""C++ programs that evaluate the exported header of a robot."""

import numpy as np

import chasles
from chasles.derive.emit.reserved import safe

FUNCTIONS = {"fk", "fk_jacobian_mixed", "twist_mixed", "hessian_mixed", "ik", "chain", "actuators"}
"""Names of the robot functions that the C++ test programs call. The set includes functions with one
result, with several results, and with solution slots."""
PUT = """\
#include <cstdio>
#include <cstring>

static void put(double value) { std::fwrite(&value, sizeof value, 1, stdout); }
template <typename Values>
static void put(const Values& values) {
  for (const double value : values) {
    put(value);
  }
}
"""


def compiled_functions(robot):
    """Return the manifest entries of the robot functions that the C++ test programs call."""
    return [info for info in robot.manifest.functions if info.name in FUNCTIONS]


def driver(name):
    """Return the source of a C++ program that evaluates a robot function for rows of inputs."""
    robot, cases = chasles.load(name), []
    for info in compiled_functions(robot):
        sizes = [int(np.prod(item.shape)) for item in info.inputs]
        starts = np.concatenate([[0], np.cumsum(sizes)])
        arguments = ", ".join(
            f"x[{start}]" if size == 1 else f"chasles::View<{size}>(x + {start})"
            for start, size in zip(starts[:-1].tolist(), sizes, strict=True)
        )
        members = [f"found.{safe(item.name)}" for item in info.outputs]
        outputs = members if len(members) > 1 else ["found"]
        puts = " ".join(f"put({output});" for output in outputs)
        cases.append(
            f'  if (!std::strcmp(argv[1], "{info.name}")) {{\n'
            f"    double x[{starts[-1]}];\n"
            f"    while (std::fread(x, sizeof x, 1, stdin)) {{\n"
            f"      const auto found = robot::{safe(info.name)}({arguments});\n      {puts}\n"
            "    }\n  }"
        )
    body = "\n".join(cases)
    return (
        f"#include <chasles/{robot.name}.hpp>\n{PUT}\nnamespace robot = chasles::{robot.name};\n\n"
        f"int main(int, char** argv) {{\n{body}\n  return 0;\n}}\n"
    )


def inputs_of(robot, info, rng, count):
    """Return random inputs of a robot function.

    If the robot has loops, the inputs are near its reference configuration, so that the loops
    close. A redundancy parameter of the inverse kinematics, as for the robot panda, gets the value
    of the last joint.
    """
    middle, spread = (np.array(robot.reference.q), 0.1) if robot.reference else (0.0, np.pi)
    q = middle + rng.uniform(-spread, spread, (count, robot.n))
    if info.inputs[0].name == "T":
        return [robot.fk(q), *(q[:, -1] for _ in info.inputs[1:])]
    first = robot.chain(q) if info.inputs[0].name == "theta" else q
    return [first, *(rng.uniform(-1, 1, (count, *item.shape)) for item in info.inputs[1:])]
