"""The crate in Rust: values, solutions, examples, and code without Rust's standard library.

The continuous integration does not install Rust.
"""

import os
import re
import shutil
import subprocess

import numpy as np
import pytest

import chasles
from chasles.derive import write
from chasles.derive.emit.precision.evaluation import evaluate
from chasles.derive.emit.rust.functions import definition, safe
from tests.support.derivations import robot_of
from tests.support.every_operation import INPUTS, every_operation
from tests.support.exports import (
    apart,
    configurations,
    expected,
    inputs_of,
    inverse_of,
    regular_slots,
    right_angles,
)
from tests.support.pages import examples

pytestmark = pytest.mark.skipif(not shutil.which("cargo"), reason="no cargo")
NAMES = ["ur5e", "panda", "puma560", "excavator"]
FUNCTIONS = ["fk", "fk_jacobian_mixed", "twist_mixed", "acceleration_mixed", "ik", "chain"]
SAMPLES = 10_000
SOLVED = 1e-9
TOLERANCE = 1e-12
"""Largest difference from the C code, for an inverse away from singularities."""
POSE_ERROR = 1e-9
"""Largest pose error of a solution."""
PAGE = "how-to/rust.md"
CALLED = {"sin", "cos", "sqrt", "atan2", "memcpy", "memset"}
"""C functions that the code without Rust's standard library calls."""
CALLER = """\
use chasles_{name}::*;
use std::io::{{stdin, stdout, BufReader, BufWriter, Read, Write}};

fn take<const M: usize>(source: &mut impl Read) -> Option<[f64; M]> {{
    let mut values = [0.0; M];
    for value in &mut values {{
        let mut bytes = [0; 8];
        source.read_exact(&mut bytes).ok()?;
        *value = f64::from_le_bytes(bytes);
    }}
    Some(values)
}}

fn main() {{
    let (mut source, mut target) = (BufReader::new(stdin()), BufWriter::new(stdout()));
    let mut put = |values: &[f64]| {{
        values.iter().for_each(|value| target.write_all(&value.to_le_bytes()).unwrap())
    }};
    match std::env::args().nth(1).unwrap().as_str() {{
{arms}
        name => panic!("{{name}}"),
    }}
}}
"""


@pytest.fixture(scope="module")
def crates(tmp_path_factory):
    """Returns a folder with the crate of each robot, and a program that calls its functions."""
    folder = tmp_path_factory.mktemp("rust")
    for name in NAMES:
        chosen = functions_of(name)
        names = [info.name for info in chosen]
        write(robot_of(name), folder / name, functions=names, languages=["rust"])
        arms = "\n".join(map(arm, chosen))
        (folder / name / "examples" / "rows.rs").write_text(CALLER.format(name=name, arms=arms))
        cargo(folder / name, "build", "--examples")
    return folder


def functions_of(name):
    return [info for info in chasles.load(name).manifest.functions if info.name in FUNCTIONS]


def cargo(crate, *command):
    """Runs cargo without a network, and returns its output; warnings are errors."""
    verb, *options = command
    words = ["cargo", verb, "--offline", "--release", "--quiet", *options]
    flags = {"RUSTFLAGS": "-D warnings", "CARGO_TARGET_DIR": str(crate / "target")}
    done = subprocess.run(
        words, cwd=crate, env=os.environ | flags, capture_output=True, check=False
    )
    assert done.returncode == 0, done.stderr.decode()
    return done.stdout.decode()


def arm(info):
    """Returns the match arm that calls a function for each row of its inputs."""
    first, *others = (int(np.prod(item.shape)) for item in info.inputs)
    takes = [
        f"let x{k} = take::<{size}>(&mut source).unwrap();" for k, size in enumerate(others, 1)
    ]
    zeros, puts = [], []
    for k, item in enumerate(info.outputs):
        is_slots = item.name == "q" and len(item.shape) > 1
        size = int(np.prod(item.shape))
        zero = f"[[0.0; N]; {item.shape[0]}]" if is_slots else f"[0.0; {size}]"
        zeros.append(f"let mut y{k} = {zero};")
        puts.append(f"put(&y{k}.concat());" if is_slots else f"put(&y{k});")
    passed = [f"&x{k}" for k in range(len(info.inputs))]
    passed += [f"&mut y{k}" for k in range(len(info.outputs))]
    lines = [*takes, *zeros, f"{info.name}({', '.join(passed)});", *puts]
    head = f'"{info.name}" => while let Some(x0) = take::<{first}>(&mut source)'
    return f"{head} {{ {' '.join(lines)} }}"


def called(crate, info, inputs):
    """Returns the results of a function in Rust for rows of inputs."""
    rows = np.hstack([np.reshape(x, (len(x), -1)) for x in inputs])
    program = crate / "target" / "release" / "examples" / "rows"
    done = subprocess.run(
        [program, info.name], input=rows.tobytes(), capture_output=True, check=True
    )
    sizes = [int(np.prod(item.shape)) for item in info.outputs]
    found = np.frombuffer(done.stdout).reshape(len(rows), sum(sizes))
    parts = np.split(found, np.cumsum(sizes)[:-1], axis=1)
    return [x.reshape(-1, *item.shape) for x, item in zip(parts, info.outputs, strict=True)]


@pytest.mark.parametrize("name", NAMES)
def test_functions_equal_the_compiled_c(name, crates):
    robot, checked = chasles.load(name), 0
    q = configurations(robot, SAMPLES)
    for info in functions_of(name):
        if info.role.is_inverse:
            continue
        inputs = inputs_of(robot, info, q)
        found, exact = called(crates / name, info, inputs), expected(robot, info, inputs)
        for x, y in zip(found, exact, strict=True):
            assert np.abs(x - y).max() <= TOLERANCE, info.name
        checked += 1
    assert checked >= 4


@pytest.mark.parametrize("name", NAMES)
def test_inverse_equals_the_compiled_c(name, crates):
    check_inverse(name, crates, configurations(chasles.load(name), SAMPLES))


@pytest.mark.parametrize("name", ["ur5e", "panda", "puma560"])
def test_inverse_is_complete_at_right_angle_poses(name, crates):
    check_inverse(name, crates, right_angles(chasles.load(name), 2000))


def check_inverse(name, crates, q):
    """Compares all solutions; at a singularity, the joints may differ and the poses may not."""
    robot = chasles.load(name)
    info = inverse_of(robot)
    inputs = inputs_of(robot, info, q)
    exact = expected(robot, info, inputs)
    q, residual, margin = called(crates / name, info, inputs)
    solved, regular = exact[1] <= SOLVED, regular_slots(robot, info, *exact[:2])
    np.testing.assert_array_equal(residual <= SOLVED, solved)
    T = np.broadcast_to(inputs[0][:, None], (*solved.shape, 4, 4))[solved]
    assert np.abs(robot.fk(q[solved]) - T).max() <= POSE_ERROR
    assert regular.sum() >= len(q) // 2
    assert apart(q, exact[0])[regular].max() <= TOLERANCE
    assert np.abs(residual - exact[1])[solved].max() <= TOLERANCE
    assert np.abs(margin - exact[2])[regular].max() <= TOLERANCE


@pytest.mark.parametrize("name", NAMES)
def test_example_prints_the_same_without_the_standard_library(name, crates):
    crate, own = crates / name, crates / name / "own"
    printed = cargo(crate, "run", "--example", "solutions")
    assert "margin" in printed
    bare = ["--no-default-features", "--target-dir", str(own)]
    assert cargo(crate, "run", "--example", "solutions", *bare) == printed
    cargo(crate, "build", *bare)
    command = ["nm", "-u", own / "release" / f"libchasles_{name}.rlib"]
    listed = subprocess.run(command, capture_output=True, check=True).stdout.decode()
    assert {"sin", "cos"} <= set(re.findall(r"^ +U (\S+)$", listed, re.MULTILINE)) <= CALLED


def test_example_of_the_page_prints_its_comment(crates):
    (example,) = examples(PAGE, "rust")
    (crates / "ur5e" / "examples" / "page.rs").write_text(example)
    (comment,) = re.findall(r"// (\d.*)$", example, re.MULTILINE)
    assert cargo(crates / "ur5e", "run", "--example", "page").strip() == comment


def test_crate_names_functions_that_need_a_solver(tmp_path):
    write(robot_of("jaco2"), tmp_path, functions=["fk", "ik"], languages=["rust"])
    text = (tmp_path / "src" / "lib.rs").read_text()
    assert "Only in C, because of an iterative solver: ik." in text
    assert "pub fn fk(" in text
    assert "pub fn ik(" not in text
    cargo(tmp_path, "run", "--example", "pose")


def test_each_operation_equals_its_meaning(crates, tmp_path):
    function, program = every_operation("x")
    crate = tmp_path / "ur5e"
    ignored = shutil.ignore_patterns("target", "solutions.rs", "page.rs")
    shutil.copytree(crates / "ur5e", crate, ignore=ignored)
    library = f"pub const N: usize = 2;\nmod math;\n{definition(function, ['All.'], program)}"
    (crate / "src" / "lib.rs").write_text(library)
    rows = CALLER.format(name="ur5e", arms=arm(function))
    (crate / "examples" / "rows.rs").write_text(rows)
    cargo(crate, "build", "--examples")
    (found,) = called(crate, function, [INPUTS])
    (exact,) = evaluate(program, [INPUTS], np.float64)
    np.testing.assert_allclose(found, exact, rtol=1e-15, atol=0)


def test_reserved_names_of_rust_get_an_underscore():
    assert [safe("match"), safe("N"), safe("q")] == ["match_", "N_", "q"]
