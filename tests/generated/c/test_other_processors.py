"""Scalar C gives the same values on an emulated 64-bit ARM processor.

The continuous integration does not install the cross compiler and the emulator.
"""

import subprocess
from pathlib import Path
from shutil import which

import numpy as np
import pytest

import chasles
from chasles.library.cache import sources_of

COMPILER, EMULATOR = "aarch64-linux-gnu-gcc", "qemu-aarch64"
FLAGS = ["-std=c99", "-O0", "-ffp-contract=fast", "-DCHASLES_NO_DISPATCH", "-static"]
MAIN = """
#include "chasles_glue.c"
#include <stdio.h>
const char chasles_hash[] = "";
int main(void)
{
    static double values[1 << 16];
    int k;
    while (fread(&k, sizeof k, 1, stdin) == 1) {
        const chasles_kernel *kernel = chasles_kernels + k;
        const double *inputs[16];
        double *outputs[16], *end = values;
        for (int i = 0; i < kernel->n_inputs; i++) {
            inputs[i] = end;
            end += kernel->sizes[i];
        }
        const size_t given = (size_t)(end - values);
        if (fread(values, sizeof *values, given, stdin) != given)
            return 1;
        double *first = end;
        for (int i = 0; i < kernel->n_outputs; i++) {
            outputs[i] = end;
            end += kernel->sizes[kernel->n_inputs + i];
        }
        kernel->call(inputs, outputs);
        fwrite(first, sizeof *values, (size_t)(end - first), stdout);
    }
    return 0;
}
"""
N = 20
SAME = 1e-12
"""Relative tolerance of function values. The two processors fuse multiplications and additions
differently."""
SAME_SOLUTION = 1e-7
"""Tolerance of inverse solutions [rad or m], which amplify rounding errors near double roots."""

pytestmark = pytest.mark.skipif(
    not (which(COMPILER) and which(EMULATOR)), reason=f"no {COMPILER} or no {EMULATOR}"
)


def built(manifest, folder: Path) -> Path:
    folder.mkdir()
    for file, content in sources_of(manifest).items():
        (folder / file).write_bytes(content)
    (folder / "main.c").write_text(MAIN)
    command = [COMPILER, *FLAGS, "main.c", "-o", "main", "-lm"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    return folder / "main"


def evaluated(command, manifest, name, *inputs):
    """Evaluate a function of a compiled program at N inputs, and return one array per output."""
    names = [function.name for function in manifest.functions]
    function = manifest.functions[names.index(name)]
    index = np.int32(names.index(name)).tobytes()
    rows = (np.concatenate([item[k].ravel() for item in inputs]) for k in range(N))
    text = b"".join(index + row.tobytes() for row in rows)
    done = subprocess.run(command, input=text, capture_output=True, check=True)
    values = np.frombuffer(done.stdout).reshape(N, -1)
    sizes = np.cumsum([int(np.prod(out.shape)) for out in function.outputs])
    parts = np.split(values, sizes[:-1], axis=1)
    return [part.reshape(N, *out.shape) for part, out in zip(parts, function.outputs, strict=True)]


def here(robot, name, *inputs):
    """Return the outputs of a function of the installed robot."""
    found = robot.functions[name].ufunc(*inputs)
    return found if isinstance(found, tuple) else (found,)


@pytest.mark.parametrize("name", ["ur5e", "iiwa14", "jaco2", "excavator", "stewart_gough"])
def test_scalar_code_gives_the_same_values_on_arm(name, tmp_path):
    robot = chasles.load(name)
    manifest = robot.manifest
    program = [EMULATOR, built(manifest, tmp_path / "there")]
    rng = np.random.default_rng(3)
    center = np.array(robot.reference.q) if robot.reference else np.zeros(robot.n)
    lower, upper = np.maximum(robot.lower, center - 1), np.minimum(robot.upper, center + 1)
    q = center + 0.5 * (rng.uniform(lower, upper, (N, robot.n)) - center)
    compared = 0
    for function in manifest.functions:
        if [item.name for item in function.inputs] != ["q"]:
            continue
        expected = here(robot, function.name, q)
        for one, other in zip(
            expected, evaluated(program, manifest, function.name, q), strict=True
        ):
            size = max(1.0, np.nanmax(np.abs(one), initial=0.0))
            np.testing.assert_allclose(other, one, rtol=0, atol=SAME * size, err_msg=function.name)
            compared += np.isfinite(one).sum()
    assert compared > 100
    inverse = manifest.with_role("inverse", "pose")
    (T,) = here(robot, "fk", q)
    given = [q[:, k] for k in inverse.role.fixed]
    if not given:
        given = [here(robot, item.name, q)[0] for item in inverse.inputs[1:]]
    expected = here(robot, inverse.name, T, *given)
    found = evaluated(program, manifest, inverse.name, T, *given)
    solved = expected[1] < SAME_SOLUTION
    np.testing.assert_array_equal(found[1] < SAME_SOLUTION, solved)
    assert solved.any(axis=1).all()
    np.testing.assert_allclose(found[0][solved], expected[0][solved], atol=SAME_SOLUTION)
