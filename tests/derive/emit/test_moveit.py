"""The MoveIt plugin, compiled with stubs of MoveIt and called through its base class."""

import re
import subprocess
import xml.etree.ElementTree as ET
from functools import cache

import numpy as np
import pytest

import chasles
from chasles.derive import read, write
from chasles.derive.model.errors import InputValueError
from tests.support import moveit
from tests.support.compiling import COMPILER
from tests.support.derivations import robot_of
from tests.support.exports import (
    apart,
    configurations,
    expected,
    inputs_of,
    inverse_of,
    regular_slots,
)
from tests.support.moveit import NO_SOLUTION, SUCCESS, TIMED_OUT, Plugin, to_pose, to_transform
from tests.support.pages import examples
from tests.support.tools import MISSING, needs

pytestmark = [
    needs("g++"),
    needs("gcc"),
    pytest.mark.skipif(
        not moveit.EIGEN_FOLDER.is_dir(), reason=f"{MISSING}: Eigen (apt-get install libeigen3-dev)"
    ),
]
NAMES = ["ur5e", "panda"]
PAGE = "how-to/moveit.md"
SAMPLES = 200
TOLERANCE = 1e-12
"""Maximum difference between results of the MoveIt plugin and of the C code, away from
singularities."""
Q = {
    "ur5e": [0.3, -1.2, 1.4, -0.5, 0.8, 0.2],
    "panda": [0.3, -0.4, 0.2, -1.9, 0.4, 1.8, 0.6],
}
"""For each robot, a configuration within its joint limits."""
CONFIG = """\
add_library({package}::{package} INTERFACE IMPORTED)
set_target_properties({package}::{package} PROPERTIES
  INTERFACE_INCLUDE_DIRECTORIES "{include};/usr/include/eigen3")
foreach(name kinematics_base robot_model robot_state)
  add_library({package}::moveit_${{name}} ALIAS {package}::{package})
endforeach()
"""
AMENT = """\
function(pluginlib_export_plugin_description_file)
endfunction()
function(ament_export_targets)
endfunction()
function(ament_export_dependencies)
endfunction()
function(ament_package)
endfunction()
"""


@pytest.fixture(scope="module")
def packages(tmp_path_factory):
    """Return a function that exports the MoveIt package of a robot."""
    folder = tmp_path_factory.mktemp("moveit")
    return cache(lambda name: moveit.exported(name, folder / name))


@pytest.fixture
def plugin(packages):
    """Return a function that initializes the MoveIt plugin of a robot."""

    def initialized(name, *, has_limits=True, step=0.1):
        found = bare(packages, name, has_limits=has_limits)
        assert found.initialize(step=step), found.error
        return found

    return initialized


def bare(packages, name, *, has_limits=True, **parameters):
    model = moveit.model_of(moveit.urdf_of(name), has_limits)
    n = len(Q[name]) if name in Q else chasles.load(name).n
    return Plugin(moveit.compiled(packages(name), name), model, n, parameters)


@pytest.mark.parametrize("name", NAMES)
def test_each_solution_of_the_c_is_found(name, plugin):
    robot, unlimited = chasles.load(name), plugin(name, has_limits=False)
    info, q = inverse_of(robot), configurations(robot, SAMPLES)
    poses = np.array([to_pose(T) for T in robot.fk(q)])
    inputs = inputs_of(robot, info, q)
    inputs[0] = np.array([to_transform(pose) for pose in poses])
    exact, residual, _ = expected(robot, info, inputs)
    regular = regular_slots(robot, info, exact, residual)
    seeds = np.random.default_rng(1).uniform(-9, 9, q.shape)
    seeds[:, list(info.role.fixed)] = q[:, list(info.role.fixed)]
    for k, pose in enumerate(poses):
        found, percentage, error = unlimited.all_solutions(pose, seeds[k])
        assert error == moveit.OK
        assert (
            len(found)
            == (residual[k] <= moveit.SOLVED).sum()
            == round(percentage * residual.shape[1])
        )
        far = np.abs(found - seeds[k]).max(axis=1)
        assert (np.diff(far) >= 0).all()
        assert far.max() <= np.pi + TOLERANCE
        near = apart(found[:, None], exact[k][None, regular[k]]).max(axis=2).min(axis=0)
        assert near.max(initial=0) <= TOLERANCE
        np.testing.assert_array_equal(unlimited.nearest(pose, seeds[k])[0], found[0])
    assert regular.sum() >= 2 * SAMPLES


@pytest.mark.parametrize("name", NAMES)
def test_forward_kinematics_equal_the_c(name, plugin):
    robot, found = chasles.load(name), plugin(name)
    for q in configurations(robot, 50):
        assert np.abs(found.forward("ee", q) - robot.fk(q)).max() <= TOLERANCE
    T = found.forward(moveit.TIP, q)
    np.testing.assert_allclose(T, robot.fk(q) @ moveit.transform(*moveit.TIP_OFFSET), atol=1e-12)
    assert found.forward("nowhere", q) is None
    assert found.names(links=False) == [joint.name for joint in robot_of(name).coordinates]
    assert found.names(links=True)[-1] == "ee"


def test_fixed_transforms_lead_to_the_frames_of_the_group(packages):
    robot, q = chasles.load("ur5e"), np.array(Q["ur5e"])
    wrong = bare(packages, "ur5e")
    assert not wrong.initialize(moveit.BASE, moveit.TIP)
    assert "chasles_base_link" in wrong.error
    placed = bare(packages, "ur5e", chasles_base_link="base")
    assert placed.initialize(moveit.BASE, moveit.TIP), placed.error
    base, tip = (moveit.transform(*at) for at in (moveit.BASE_OFFSET, moveit.TIP_OFFSET))
    T = base @ robot.fk(q) @ tip
    np.testing.assert_allclose(placed.forward(moveit.TIP, q), T, atol=1e-12)
    np.testing.assert_allclose(placed.nearest(to_pose(T), q)[0], q, atol=1e-12)
    assert len(placed.all_solutions(to_pose(T), q)[0]) == 8


def test_wrong_models_are_refused(packages):
    library = moveit.compiled(packages("ur5e"), "ur5e")
    urdf = moveit.urdf_of("ur5e")
    longer = Plugin(library, moveit.model_of(urdf.replace("-0.425", "-0.426")), 6)
    assert not longer.initialize()
    assert "differs from the exported robot by 0.000" in longer.error
    turned = urdf.replace('<axis xyz="0 -1 0"/>', '<axis xyz="0 1 0"/>')
    assert not Plugin(library, moveit.model_of(turned), 6).initialize()
    fewer = re.sub(r'"wrist_3" type="revolute"', '"wrist_3" type="fixed"', urdf)
    short = Plugin(library, moveit.model_of(fewer), 6)
    assert not short.initialize()
    assert "has 6 joints, the chain of the group has 5" in short.error
    right = bare(packages, "ur5e")
    assert not right.initialize(group="leg")
    assert not right.initialize(tip="nowhere")
    assert not right.initialize(base="ee", tip="base")
    assert right.nearest(to_pose(np.eye(4)), np.zeros(6)) == (None, NO_SOLUTION)
    moving = bare(packages, "ur5e", chasles_base_link="link1")
    assert not moving.initialize()
    assert "a joint moves link1 relative to base" in moving.error
    missing = bare(packages, "ur5e", chasles_base_link="nowhere")
    assert not missing.initialize()
    assert "has no link nowhere" in missing.error


@pytest.mark.parametrize("kind", ["fixed", "revolute"])
def test_joints_outside_the_group_must_not_move_the_tip(kind, packages):
    end = f'<joint name="ee_{moveit.TIP}" type="{kind}"><axis xyz="0 1 0"/>'
    urdf = re.sub(rf'<joint name="ee_{moveit.TIP}".*?/>', end, moveit.urdf_of("ur5e"))
    parameters = {"chasles_tip_link": moveit.TIP}
    library = moveit.compiled(packages("ur5e"), "ur5e")
    found = Plugin(library, moveit.model_of(urdf), 6, parameters)
    assert found.initialize(tip=moveit.TIP) == (kind == "fixed")
    assert kind == "fixed" or "differs from the exported robot" in found.error


@pytest.mark.parametrize("name", NAMES)
def test_solutions_obey_the_limits_of_the_model(name, plugin):
    robot, limited, free = chasles.load(name), plugin(name), plugin(name, has_limits=False)
    limits = np.array([[float(v) for v in joint.limits] for joint in robot_of(name).coordinates])
    low, high = limits.T
    kept = 0
    for q in np.random.default_rng(2).uniform(low, high, (100, len(low))):
        pose = to_pose(robot.fk(q))
        found, every = limited.all_solutions(pose, q)[0], free.all_solutions(pose, q)[0]
        assert ((found >= low) & (found <= high)).all()
        turns = 2 * np.pi * np.arange(-2, 3)[:, None, None]
        copies = every + turns
        fits = ((copies >= low - 1e-9) & (copies <= high + 1e-9)).any(axis=0).all(axis=1)
        assert len(found) == fits.sum()
        np.testing.assert_allclose(found[0], q, atol=1e-6)
        kept += len(found)
    assert kept >= 100


def test_seed_selects_the_solution_and_its_full_turns(plugin):
    found, q = plugin("ur5e"), np.array(Q["ur5e"])
    pose = to_pose(chasles.load("ur5e").fk(q))
    every = found.all_solutions(pose, q)[0]
    for row in every:
        np.testing.assert_allclose(found.nearest(pose, row)[0], row, atol=1e-9)
        np.testing.assert_allclose(found.search(pose, row + 0.01)[0], row, atol=1e-9)
    turned = q - 2 * np.pi * np.array([1, 0, 0, 0, 0, 1])
    np.testing.assert_allclose(found.nearest(pose, turned + 0.1)[0], turned, atol=1e-9)
    beyond = q + 2 * np.pi * np.array([1, 0, 0, 0, 0, 1])  # outside the joint limits
    rows = found.all_solutions(pose, beyond)[0]
    assert np.abs(rows - q).max(axis=1).min() <= 1e-9
    assert found.nearest(pose, q * np.nan) == (None, NO_SOLUTION)
    scaled = pose * [1, 1, 1, 2, 2, 2, 2]  # the quaternion has the norm 2
    np.testing.assert_allclose(found.nearest(scaled, q)[0], q, atol=1e-9)


@pytest.mark.parametrize("as_list", [False, True])
def test_callback_rejects_solutions(as_list, plugin):
    found, q = plugin("ur5e"), np.array(Q["ur5e"])
    pose = to_pose(chasles.load("ur5e").fk(q))
    every, seen = found.all_solutions(pose, q)[0], []

    def third(theta):
        seen.append(theta)
        return len(seen) == 3

    theta, code = found.search(pose, q, accept=third, as_list=as_list)
    assert code == SUCCESS
    np.testing.assert_array_equal(seen, every[:3])
    np.testing.assert_array_equal(theta, every[2])
    seen.clear()
    missing = found.search(pose, q, accept=seen.append, as_list=as_list)
    assert missing == (None, NO_SOLUTION)
    assert len(seen) == len(every)


@pytest.mark.parametrize("accept", [None, lambda theta: True])
def test_consistency_limits_bound_the_distance_from_the_seed(accept, plugin):
    found, q = plugin("panda", step=0.01), np.array(Q["panda"])
    pose, seed = to_pose(chasles.load("panda").fk(q)), q + 0.05
    limits = np.full(7, 0.2)
    theta, code = found.search(pose, seed, limits=limits, accept=accept)
    assert code == SUCCESS
    assert (np.abs(theta - seed) <= limits).all()
    assert found.search(pose, seed, limits=limits / 1e3, accept=accept) == (None, NO_SOLUTION)
    assert found.search(pose, seed, limits=limits, accept=accept, as_list=True)[1] == SUCCESS
    one = np.array([0.2] * 6 + [0.0])
    assert found.search(pose, seed, limits=one, accept=accept)[0][6] == seed[6]


def test_search_samples_the_redundant_joint(plugin):
    robot, found = chasles.load("panda"), plugin("panda", step=0.05)
    q = np.array(Q["panda"])
    pose = to_pose(robot.fk(q))
    seed = q.copy()
    seed[6] = -2.8
    assert found.nearest(pose, seed) == (None, NO_SOLUTION)
    assert found.search(pose, seed, locked=True) == (None, NO_SOLUTION)
    theta, code = found.search(pose, seed)
    assert code == SUCCESS
    np.testing.assert_allclose(robot.fk(theta), robot.fk(q), atol=1e-9)
    values = []

    def seen(theta):
        values.append(theta[6])
        return False

    assert found.search(pose, q, accept=seen) == (None, NO_SOLUTION)
    steps = (np.unique(values) - q[6]) / 0.05
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)
    far = np.abs(np.array(values) - q[6])
    assert (np.diff(far) >= -1e-12).all()
    assert len(np.unique(values)) > 20


def test_search_ends_at_its_timeout(plugin):
    found, q = plugin("panda", step=1e-9), np.array(Q["panda"])
    pose, values = to_pose(chasles.load("panda").fk(q)), set()

    def seen(theta):
        values.add(theta[6])
        return False

    assert found.search(pose, q, timeout=0.0, accept=seen) == (None, TIMED_OUT)
    assert values == {q[6]}
    assert found.search(pose, q, timeout=0.02, accept=seen) == (None, TIMED_OUT)
    assert len(values) > 1
    assert found.search(pose, q, timeout=0.0)[1] == SUCCESS


def test_discretization_lists_solutions_of_further_samples(plugin):
    robot, found = chasles.load("panda"), plugin("panda")
    q = np.array(Q["panda"])
    pose = to_pose(robot.fk(q))
    few = found.all_solutions(pose, q)[0]
    for method in (moveit.ALL_DISCRETIZED, moveit.ALL_RANDOM):
        many, percentage, error = found.all_solutions(pose, q, method)
        assert error == moveit.OK
        assert len(many) > 5 * len(few)
        assert 0 < percentage < 1
        np.testing.assert_array_equal(many[: len(few)], few)
        np.testing.assert_allclose(
            robot.fk(many), np.tile(robot.fk(q), (len(many), 1, 1)), atol=1e-9
        )
        steps = (many[len(few) :, 6] - q[6]) / 0.1
        is_step = np.abs(steps - np.round(steps)) <= 1e-9
        assert is_step.all() if method == moveit.ALL_DISCRETIZED else not is_step.any()
    assert found.all_solutions(pose, q, moveit.SOME_DISCRETIZED)[2] == moveit.UNSUPPORTED
    assert found.all_solutions(pose, q, poses=2)[2] == moveit.MULTIPLE_TIPS
    assert found.all_solutions(pose, q, poses=0)[2] == moveit.EMPTY
    far = pose * [9, 9, 9, 1, 1, 1, 1]
    assert found.all_solutions(far, q)[2] == moveit.NONE
    arm = plugin("ur5e")
    assert arm.all_solutions(pose, np.zeros(6), moveit.ALL_DISCRETIZED)[2] == moveit.UNSUPPORTED


def test_only_the_exported_redundant_joint_is_accepted(plugin):
    found, q = plugin("panda", step=0.07), np.array(Q["panda"])
    assert found.set_redundant(6)  # MoveIt resets the sampling step to 0.1 rad
    pose = to_pose(chasles.load("panda").fk(q))
    steps = (found.all_solutions(pose, q, moveit.ALL_DISCRETIZED)[0][:, 6] - q[6]) / 0.1
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)
    assert not found.set_redundant(5)
    assert not plugin("ur5e").set_redundant(5)


@pytest.mark.parametrize(("ending", "compiler"), [(".hpp", "g++"), (".h", moveit.COMPILER)])
def test_sources_compile_without_warnings(ending, compiler, packages, tmp_path):
    """In MoveIt versions up to 2.12, header names end in .h instead of .hpp."""
    package = packages("ur5e")
    stubs = tmp_path / "include"
    for header in (moveit.STUBS / "include").rglob("*.hpp"):
        name = str(header.relative_to(moveit.STUBS / "include"))
        copied = stubs / with_ending(name, ending)
        copied.parent.mkdir(parents=True, exist_ok=True)
        copied.write_text(with_ending(header.read_text(), ending))
    places = [f"-I{stubs}", f"-I{package / 'include/chasles_ur5e_moveit'}"]
    flags = [*moveit.WARNINGS, *moveit.EIGEN, *places, "-fsyntax-only"]
    subprocess.run([compiler, "-std=c++17", *flags, package / "src" / "plugin.cpp"], check=True)


def with_ending(text, ending):
    """Replace the file extension of MoveIt header names in a text."""
    return re.sub(r"\b(moveit/\w+/\w+)\.hpp", rf"\1{ending}", text)


def test_swivel_angle_is_an_input(tmp_path):
    write(robot_of("iiwa14"), tmp_path, functions=["fk", "ik", "swivel"], languages=["moveit"])
    source = (tmp_path / "src" / "plugin.cpp").read_text()
    assert "Values{robot::swivel(theta)}" in source
    assert "REDUNDANT = {};" in source


def test_robot_with_loops_has_a_plugin_for_its_chain(packages):
    robot, found = chasles.load("excavator"), bare(packages, "excavator")
    assert found.initialize(), found.error
    for q in configurations(robot, 50):
        theta, T = robot.chain(q), robot.fk(q)
        np.testing.assert_allclose(found.nearest(to_pose(T), theta)[0], theta, atol=1e-9)
        np.testing.assert_allclose(found.forward("ee", theta), T, atol=1e-12)


def test_mimic_joint_follows_in_the_chain(tmp_path):
    urdf = moveit.urdf_of("ur5e").replace('name="ur5e"', 'name="mimic"')
    start = urdf.index("</joint>", urdf.index('"wrist_1"'))
    urdf = f'{urdf[:start]}<mimic joint="elbow" multiplier="-1"/>{urdf[start:]}'
    (tmp_path / "mimic.urdf").write_text(urdf)
    robot = read(tmp_path / "mimic.urdf", base="base", tip="ee")
    functions = ["fk", "ik", "chain", "actuators"]
    write(robot, tmp_path / "mimic", functions=functions, languages=["moveit"])
    library = moveit.compiled(tmp_path / "mimic", "mimic")
    found = Plugin(library, moveit.model_of(urdf), 5)
    assert found.initialize(), found.error
    assert "wrist_1" not in found.names(links=False)
    q = np.array([0.3, -1.2, 1.4, 0.8, 0.2])
    T = chasles.load("ur5e").fk(np.insert(q, 3, -q[2]))
    assert np.abs(found.forward("ee", q) - T).max() <= TOLERANCE
    np.testing.assert_allclose(found.nearest(to_pose(T), q)[0], q, atol=1e-9)


def run_cpp(package, source, folder):
    """Compile a program for the excavator, and return its output."""
    include = package / "include"
    robot, program = folder / "robot.o", folder / "program"
    places = [f"-I{include}", f"-I{include / 'chasles_excavator_moveit'}"]
    c = ["gcc", "-std=c99", *places, "-c", package / "src" / "excavator.c", "-o", robot]
    cpp = ["g++", "-std=c++17", *moveit.WARNINGS, *places, source, robot, "-lm", "-o", program]
    for command in (c, cpp):
        subprocess.run(command, check=True)
    return subprocess.run([program], capture_output=True, text=True, check=True).stdout


def test_hardware_example_moves_the_actuators(packages, tmp_path):
    robot, package = chasles.load("excavator"), packages("excavator")
    text = run_cpp(package, package / "examples" / "hardware.cpp", tmp_path)
    printed = {key: float(value) for key, value in re.findall(r"(\w+) = (\S+)", text)}
    q = np.array(robot.reference.q)
    q[3] += 0.02
    np.testing.assert_allclose(list(printed.values()), robot.configuration(q), atol=1e-6)
    assert printed["bucket_cylinder"] == pytest.approx(q[3], abs=1e-6)


def test_example_of_the_page_maps_joint_states(packages, tmp_path):
    (example,) = examples(PAGE, "cpp")
    source = tmp_path / "page.cpp"
    source.write_text(example)
    printed = run_cpp(packages("excavator"), source, tmp_path).splitlines()
    assert printed == re.findall(r"// (.*)$", example, re.MULTILINE)


@needs("cmake")
def test_package_builds_with_cmake(packages, tmp_path):
    package, prefix = packages("excavator"), tmp_path / "prefix"
    for name in ("moveit_core", "pluginlib", "rclcpp", "tf2_eigen", "ament_cmake"):
        folder = prefix / "lib" / "cmake" / name
        folder.mkdir(parents=True)
        text = CONFIG.format(package=name, include=moveit.STUBS / "include")
        (folder / f"{name}Config.cmake").write_text(AMENT if name == "ament_cmake" else text)
    build = tmp_path / "build"
    flags = [f"-DCMAKE_PREFIX_PATH={prefix}", "-DCMAKE_BUILD_TYPE=None"]
    flags += [f"-DCMAKE_CXX_COMPILER={moveit.COMPILER}", f"-DCMAKE_C_COMPILER={COMPILER or 'gcc'}"]
    for command in (["-S", package, "-B", build, *flags], ["--build", build]):
        done = subprocess.run(["cmake", *command], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
    assert (build / "libchasles_excavator_moveit.so").is_file()
    assert (build / "hardware").is_file()


def test_descriptions_of_the_package_name_the_plugin(packages):
    package = packages("ur5e")
    described = ET.parse(package / "plugin.xml").getroot()
    assert described.get("path") == "chasles_ur5e_moveit"
    (plugin_class,) = described
    name = plugin_class.get("name")
    assert plugin_class.get("base_class_type") == "kinematics::KinematicsBase"
    source = (package / "src" / "plugin.cpp").read_text()
    assert f"PLUGINLIB_EXPORT_CLASS({plugin_class.get('type')}, " in source
    assert f"kinematics_solver: {name}" in (package / "config" / "kinematics.yaml").read_text()
    assert ET.parse(package / "package.xml").findtext("name") == "chasles_ur5e_moveit"
    assert (
        f"project({ET.parse(package / 'package.xml').findtext('name')} "
        in (package / "CMakeLists.txt").read_text()
    )


def test_parameters_of_the_page_are_in_the_package(packages):
    text = (packages("ur5e") / "config" / "kinematics.yaml").read_text()
    lines = text.replace("# chasles_", "chasles_").splitlines()
    for example in examples(PAGE, "yaml"):
        assert set(example.splitlines()) <= set(lines)


def test_missing_functions_are_named(tmp_path):
    with pytest.raises(InputValueError, match="planar_3rrr: a MoveIt plugin requires an inverse"):
        write(robot_of("planar_3rrr"), tmp_path, functions=["fk"], languages=["moveit"])
    with pytest.raises(InputValueError, match="ur5e: a MoveIt plugin requires fk"):
        write(robot_of("ur5e"), tmp_path, functions=["ik"], languages=["moveit"])
