"""Tests the Rust crate, also without the Rust standard library.

These tests do not run in the continuous integration, which does not install Rust.
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
NAMES = ["ur5e", "panda", "excavator"]
FUNCTIONS = ["fk", "fk_jacobian_mixed", "twist_mixed", "acceleration_mixed", "ik", "chain"]
SAMPLES = 10_000
SOLVED = 1e-9
TOLERANCE = 1e-12
"""Maximum difference between inverse results of Rust and C, away from singularities."""
POSE_ERROR = 1e-9
"""Maximum pose error of an inverse kinematics solution."""
PAGE = "how-to/rust.md"
CALLED = {"sin", "cos", "sqrt", "atan2", "memcpy", "memset"}
"""C functions that a generated crate calls if built without Rust's standard library."""
NEAREST = """\
"ik_nearest" => while let Some(x0) = take::<{size}>(&mut source) {{
    let (q_seed, lower) = (take(&mut source).unwrap(), take::<N>(&mut source).unwrap());
    let (upper, weights) = (take::<N>(&mut source).unwrap(), take(&mut source).unwrap());
    let limits = std::array::from_fn(|j| [lower[j], upper[j]]);
    let row = match ik_nearest(&x0, &q_seed, &limits, &weights) {{
        Ok(found) => (found.q, [found.residual, found.margin, found.slot as f64]),
        Err(reason) => ([f64::NAN; N], match reason {{
            Missing::OutOfReach {{ residual, margin }} => [residual, margin, -1.0],
            Missing::OutsideLimits {{ residual, margin }} => [residual, margin, -2.0],
            Missing::NotFinite => [f64::NAN, f64::NAN, -3.0],
        }}),
    }};
    put(&row.0);
    put(&row.1);
}}
"""
"""The ``match`` arm in Rust that calls ``ik_nearest`` for each row of inputs."""
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
    folder = tmp_path_factory.mktemp("rust")
    for name in NAMES:
        chosen = functions_of(name)
        names = [info.name for info in chosen]
        write(robot_of(name), folder / name, functions=names, languages=["rust"])
        size = int(np.prod(inverse_of(chasles.load(name)).inputs[0].shape))
        arms = "\n".join([*map(arm, chosen), NEAREST.format(size=size)])
        (folder / name / "examples" / "rows.rs").write_text(CALLER.format(name=name, arms=arms))
        cargo(folder / name, "build", "--examples")
    return folder


def functions_of(name):
    return [info for info in chasles.load(name).manifest.functions if info.name in FUNCTIONS]


def cargo(crate, *command):
    """Run cargo without a network. Warnings are errors."""
    verb, *options = command
    words = ["cargo", verb, "--offline", "--release", "--quiet", *options]
    flags = {"RUSTFLAGS": "-D warnings", "CARGO_TARGET_DIR": str(crate / "target")}
    done = subprocess.run(
        words, cwd=crate, env=os.environ | flags, capture_output=True, check=False
    )
    assert done.returncode == 0, done.stderr.decode()
    return done.stdout.decode()


def arm(info):
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
    rows = np.hstack([np.reshape(x, (len(x), -1)) for x in inputs])
    sizes = [int(np.prod(item.shape)) for item in info.outputs]
    found = run_rows(crate, info.name, rows).reshape(len(rows), sum(sizes))
    parts = np.split(found, np.cumsum(sizes)[:-1], axis=1)
    return [x.reshape(-1, *item.shape) for x, item in zip(parts, info.outputs, strict=True)]


def run_rows(crate, name, rows):
    program = crate / "target" / "release" / "examples" / "rows"
    done = subprocess.run([program, name], input=rows.tobytes(), capture_output=True, check=True)
    return np.frombuffer(done.stdout)


def called_nearest(crate, robot, T, q_seed, limits=None, weights=None):
    """Call ik_nearest in Rust; return q, residual, margin and index of the nearest solutions."""
    lower, upper = np.transpose(robot.limits if limits is None else limits)
    weights = np.ones(robot.n) if weights is None else weights
    shared = np.tile(np.concatenate([lower, upper, weights]), (len(T), 1))
    rows = np.hstack([T.reshape(len(T), -1), q_seed, shared])
    found = run_rows(crate, "ik_nearest", rows).reshape(len(T), robot.n + 3)
    return found[:, : robot.n], *found[:, robot.n :].T


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


@pytest.mark.parametrize("name", ["ur5e", "panda"])
def test_inverse_is_complete_at_right_angle_poses(name, crates):
    check_inverse(name, crates, right_angles(chasles.load(name), 2000))


def check_inverse(name, crates, q):
    """Compare all inverse kinematics solutions of Rust and C.

    At a singularity, only the poses must agree.
    """
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
def test_nearest_solution_equals_the_compiled_c(name, crates):
    robot, rng = chasles.load(name), np.random.default_rng(5)
    info, q = inverse_of(robot), configurations(robot, SAMPLES)
    seed = q + rng.uniform(-1, 1, q.shape) * (0.1 if robot.reference else 2)
    seed[:, list(info.role.fixed)] = q[:, list(info.role.fixed)]
    T, weights = robot.fk(q), rng.uniform(0.5, 2, robot.n)
    narrow = np.quantile(q, [0.1, 0.9], axis=0).T
    for options in ({}, {"weights": weights}, {"limits": narrow}):
        exact = robot.ik_nearest(T, seed, **options)
        found, residual, _, slot = called_nearest(crates / name, robot, T, seed, **options)
        states = np.select([exact.valid, exact.reason == "limits"], [0, -2], -1)
        np.testing.assert_array_equal(np.minimum(slot, 0), states)
        np.testing.assert_array_equal(np.isnan(found), np.isnan(exact.q))
        regular = regular_slots(robot, info, exact.q, np.where(exact.valid, exact.residual, 1))
        assert regular.sum() > SAMPLES // 10
        assert residual[exact.valid].max() <= SOLVED
        lengths = options.get("weights", np.ones(robot.n))
        own, other = (np.abs((x - seed) * lengths)[regular].max(axis=1) for x in (found, exact.q))
        assert np.abs(own - other).max() <= TOLERANCE * lengths.max()
        assert (np.abs(found - exact.q)[regular].max(axis=1) <= TOLERANCE).mean() >= 0.998


def test_nearest_solution_reports_its_reason(crates):
    robot = chasles.load("ur5e")
    q = np.array([[0.4, -1.2, 1.3, 0.4, 0.5, 0.6]] * 4)
    T, seed = robot.fk(q), q.copy()
    T[1, :3, 3] = 9
    T[2], seed[3, 3] = np.nan, np.nan
    found, residual, _, slot = called_nearest(crates / "ur5e", robot, T, seed)
    assert slot[0] >= 0
    np.testing.assert_array_equal(slot[1:], [-1, -3, -3])
    assert residual[1] > 1
    np.testing.assert_allclose(found[0], q[0], atol=1e-12)
    narrow = np.tile([-0.1, 0.1], (6, 1))
    assert called_nearest(crates / "ur5e", robot, T[:1], q[:1], limits=narrow)[3] == -2
    turned = q[:1] + 2 * np.pi * np.array([0, 0, 0, 1, 1, 1])
    wide = np.tile([-9.0, 9.0], (6, 1))
    found, *_ = called_nearest(crates / "ur5e", robot, T[:1], turned, limits=wide)
    np.testing.assert_allclose(found, turned, atol=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_example_prints_the_same_without_the_standard_library(name, crates):
    crate, own = crates / name, crates / name / "own"
    assert examples(PAGE, "") == ["cargo run --release --example solutions\n"]
    printed = cargo(crate, "run", "--example", "solutions")
    assert "margin" in printed
    bare = ["--no-default-features", "--target-dir", str(own)]
    assert cargo(crate, "run", "--example", "solutions", *bare) == printed
    cargo(crate, "build", *bare)
    command = ["nm", "-u", own / "release" / f"libchasles_{name}.rlib"]
    listed = subprocess.run(command, capture_output=True, check=True).stdout.decode()
    assert {"sin", "cos"} <= set(re.findall(r"^ +U (\S+)$", listed, re.MULTILINE)) <= CALLED


@pytest.mark.parametrize("example", examples(PAGE, "rust"), ids=["all", "nearest"])
def test_examples_of_the_page_print_their_comments(example, crates):
    (crates / "ur5e" / "examples" / "page.rs").write_text(example)
    (comment,) = re.findall(r"// (\d.*)$", example, re.MULTILINE)
    assert cargo(crates / "ur5e", "run", "--example", "page").strip() == comment


def test_dependency_of_the_page_links_the_mathematical_functions_of_c(crates, tmp_path):
    (dependency,) = examples(PAGE, "toml")
    (tmp_path / "robots").symlink_to(crates)
    package = '[package]\nname = "program"\nversion = "1.0.0"\nedition = "2021"\n\n'
    (tmp_path / "Cargo.toml").write_text(package + dependency)
    (tmp_path / "src").mkdir()
    program = examples(PAGE, "rust")[0]
    (tmp_path / "src" / "main.rs").write_text(program)
    assert f"// {cargo(tmp_path, 'run').strip()}\n" in program


def test_crate_names_functions_that_need_a_solver(tmp_path):
    write(robot_of("jaco2"), tmp_path, functions=["fk", "ik"], languages=["rust"])
    text = (tmp_path / "src" / "lib.rs").read_text()
    assert "Only in C, because of an iterative solver: ik." in text
    assert " ik_nearest." in text
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
