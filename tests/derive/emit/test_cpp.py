"""The C++ package of a robot: header, examples, Eigen adapter and CMake package."""

import os
import re
import subprocess

import numpy as np
import pytest

import chasles
from chasles.derive import read, write
from tests.support.compiling import COMPILER
from tests.support.cpp_driver import FUNCTIONS, compiled_functions, driver, inputs_of
from tests.support.derivations import description, robot_of
from tests.support.pages import examples
from tests.support.tools import needs, reason

pytestmark = [needs("g++"), needs("cmake")]
NAMES = ["ur5e", "excavator", "planar_3rrr"]
"""Names of a serial arm, a robot whose loops have a closed form, and a platform whose loops are
solved by iteration."""
PAGE = "how-to/cpp.md"
WARNINGS = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror"]
CONSUMER = """\
cmake_minimum_required(VERSION 3.16)
project(consumer CXX)
include(FetchContent)
add_executable(ur5e ur5e.cpp)
add_executable(program page.cpp)
"""
FETCHED = """\
FetchContent_Declare(chasles_{name} SOURCE_DIR {source})
FetchContent_MakeAvailable(chasles_{name})
add_executable({name} {name}.cpp)
target_link_libraries({name} PRIVATE chasles::{name} chasles::ur5e)
"""
EIGEN = """\
#include <chasles/eigen.hpp>
#include <chasles/ur5e.hpp>

int main() {
  namespace robot = chasles::ur5e;
  Eigen::Matrix<double, 6, 1> q, qd;
  q << 0.1, -1.2, 1.3, 0.4, 0.5, 0.6;
  qd << 0.3, 0.2, 0.1, -0.1, -0.2, -0.3;
  const auto forward = robot::fk_jacobian_mixed(chasles::view(q));
  const auto V = robot::twist_mixed(chasles::view(q), chasles::view(qd));
  const Eigen::Isometry3d T = chasles::isometry(forward.T_0_ee);
  const double error = (chasles::eigen(forward.J) * qd - chasles::eigen(V)).norm();
  const double turned = (T.linear() * T.linear().transpose() - Eigen::Matrix3d::Identity()).norm();
  const auto nearest = robot::ik_nearest(chasles::pose(T), chasles::view(q));
  return !(error < 1e-12 && turned < 1e-12 && nearest &&
           (chasles::eigen(nearest.q) - q).norm() < 1e-9);
}
"""


def run(*command, cwd=None, given=None, env=None):
    """Run a command, and show its output if the command fails."""
    words = [str(word) for word in command]
    done = subprocess.run(words, cwd=cwd, input=given, env=env, capture_output=True, check=False)
    assert done.returncode == 0, (done.stdout + done.stderr).decode(errors="replace")
    return done.stdout


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Write the C++ sources of each robot and build a program with these sources.

    The test program of the UR5e uses the installed CMake package, not the C++ sources directly.
    """
    folder = tmp_path_factory.mktemp("packages")
    (folder / "robots").symlink_to(folder)
    project = CONSUMER + examples(PAGE, "cmake")[0]
    project += "target_link_libraries(ur5e PRIVATE chasles::ur5e)\n"
    for name in NAMES:
        functions = sorted(FUNCTIONS & set(chasles.load(name).functions))
        write(robot_of(name), folder / name, functions=functions, languages=["cpp"])
        (folder / f"{name}.cpp").write_text(driver(name))
        project += FETCHED.format(name=name, source=folder / name) if name != "ur5e" else ""
    (folder / "CMakeLists.txt").write_text(project)
    (folder / "page.cpp").write_text(examples(PAGE, "cpp")[0])
    # Clang compiles the generated C code in a tenth of GCC's time, but the C++ code is compiled by
    # GCC.
    settings = {"CC": COMPILER or "gcc", "CMAKE_BUILD_TYPE": "None", "CFLAGS": "-O0"}
    settings = os.environ | settings | {"HOME": str(folder)}
    run("bash", "-ec", examples(PAGE, "")[0], cwd=folder, env=settings)
    prefix = f"-DCMAKE_PREFIX_PATH={folder / '.local'}"
    run("cmake", "-S", ".", "-B", "consumer", prefix, cwd=folder, env=settings)
    run("cmake", "--build", "consumer", cwd=folder)
    return folder


@pytest.mark.parametrize("name", NAMES)
def test_functions_return_what_the_robot_returns(name, built):
    robot, rng, count = chasles.load(name), np.random.default_rng(5), 100
    checked = 0
    for info in compiled_functions(robot):
        inputs = inputs_of(robot, info, rng, count)
        rows = np.hstack([item.reshape(count, -1) for item in inputs])
        printed = run(built / "consumer" / name, info.name, given=rows.tobytes())
        expected = getattr(robot, info.name)(*inputs)
        if info.role.is_inverse:
            expected = (expected.q, expected.residual, expected.margin)
        expected = expected if isinstance(expected, tuple) else (expected,)
        flat = np.hstack([np.reshape(item, (count, -1)) for item in expected])
        found = np.frombuffer(printed).reshape(flat.shape)
        np.testing.assert_allclose(found, flat, rtol=1e-11, atol=1e-12)
        checked += 1
    assert checked >= 5


@pytest.mark.parametrize("name", NAMES)
def test_headers_and_example_compile_without_warnings(name, built):
    example = built / name / "examples" / "control_loop.cpp"
    include = built / name / "include"
    run("g++", "-std=c++17", "-fsyntax-only", *WARNINGS, "-I", include, example)


def test_example_of_the_page_prints_its_comment(built):
    (expected,) = re.findall(r"// (.*)", examples(PAGE, "cpp")[0])
    assert run(built / "consumer" / "program").decode().strip() == expected


def test_control_loop_follows_its_path(built):
    printed = run(built / "build" / "control_loop").decode()
    values = dict(re.findall(r"(\w+) = (\S+) rad", printed))
    assert list(values) == [joint.name for joint in robot_of("ur5e").coordinates]
    assert float(values["elbow"]) == pytest.approx(0.4)


@needs("pkg-config")
def test_pkg_config_and_eigen_find_the_installed_package(built, tmp_path):
    if subprocess.run(["pkg-config", "--exists", "eigen3"], check=False).returncode:
        pytest.skip(reason("pkg-config"))
    (tmp_path / "program.cpp").write_text(EIGEN)
    (folder,) = built.joinpath(".local").rglob("pkgconfig")
    path = {"PKG_CONFIG_PATH": str(folder), "PATH": os.environ["PATH"]}
    flags = run("pkg-config", "--cflags", "--libs", "chasles_ur5e", "eigen3", env=path)
    words = flags.decode().split()
    run("g++", "-std=c++17", "program.cpp", *words, "-o", "program", cwd=tmp_path)
    run(tmp_path / "program")


def test_names_that_cpp_reserves_compile(tmp_path):
    text = description("scara").read_text().replace('name = "scara"', 'name = "this"')
    file = tmp_path / "this.toml"
    file.write_text(text.replace('name = "quill"', 'name = "new"'))
    write(read(file), tmp_path / "out", functions=["fk", "ik"], languages=["cpp"])
    example = tmp_path / "out" / "examples" / "control_loop.cpp"
    include = tmp_path / "out" / "include"
    run("g++", "-std=c++17", "-fsyntax-only", *WARNINGS, "-I", include, example)
