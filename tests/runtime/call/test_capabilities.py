"""A robot has only the attributes that its joints and loops support.

The error for a missing attribute suggests a similar attribute.
"""

import pydoc
import re

import numpy as np
import pytest

import chasles
from chasles.call.capabilities import Capability
from tests.support.compiling import own_robots_compiled_quickly


def message(robot, name):
    with pytest.raises(AttributeError) as error:
        getattr(robot, name)
    assert error.value.name == name
    assert error.value.obj is robot
    return str(error.value)


def test_name_without_representation_suggests_all_three():
    arm = chasles.load("ur5e")
    for name in ("jacobian", "twist", "acceleration"):
        three = ", ".join(f"{name}_{kind}" for kind in ("space", "body", "mixed"))
        assert f"; instead: {three}; nearest functions: " in message(arm, name)
    three = "jacobian_space_dot, jacobian_body_dot, jacobian_mixed_dot"
    assert f"; instead: {three}; nearest functions: " in message(arm, "jacobian_dot")
    assert "; instead: hessian_mixed; nearest functions: " in message(arm, "hessian")


@pytest.mark.parametrize(
    ("name", "reason", "substitutes"),
    [
        ("planar_3rrr", "its loops are solved by iteration", ("ik_planar", "actuators")),
        ("planar_3rrr_170", "its loops are solved by iteration", ("actuators", "ik_numeric")),
    ],
    ids=["planar_3rrr", "planar_3rrr_170"],
)
def test_a_robot_without_an_inverse_names_the_reason_and_substitutes(name, reason, substitutes):
    with own_robots_compiled_quickly():
        robot = chasles.load(name)
    text = message(robot, "ik")
    assert text.startswith(f"robot '{name}' has no 'ik': {reason}")
    for substitute in substitutes:
        stated, _, functions = text.partition("; instead: ")[2].partition("; nearest functions: ")
        assert f"{substitute}, which " in stated
        assert functions
        assert hasattr(robot, substitute)


@pytest.mark.parametrize("name", ["ur5e", "iiwa14", "excavator", "stewart_gough", "planar_3rrr"])
def test_dir_lists_exactly_available_attributes(name):
    robot = chasles.load(name)
    listed = dir(robot)
    intermediate = {f.name for f in robot.manifest.functions if f.role.is_intermediate}
    assert {*robot.functions} - {*listed} == intermediate
    for attribute in listed:
        assert hasattr(robot, attribute), attribute
    for attribute in ("jacobian", "twist"):
        assert attribute not in listed
    missing = {"ik", "ik_path", "chain_branches", "track", "fk_planar_all"} - {*listed}
    assert missing
    for attribute in missing:
        assert not hasattr(robot, attribute), attribute


def test_all_robots_are_of_one_class():
    for name in ("ur5e", "excavator", "stewart_gough"):
        assert type(chasles.load(name)) is chasles.Robot


def test_a_method_is_a_plain_attribute_after_its_first_use():
    arm = chasles.load("ur5e")
    method = arm.ik_numeric
    assert vars(arm)["ik_numeric"] is method is arm.ik_numeric


def test_a_function_is_a_plain_attribute_of_the_instance():
    arm = chasles.load("ur5e")
    assert vars(arm)["fk"] is arm.functions["fk"]
    for owner in type(arm).__mro__[:-1]:
        assert not {"__getattr__", "__getattribute__"} & vars(owner).keys()


def test_wrong_types_and_wrong_values_raise_distinct_errors():
    arm = chasles.load("ur5e")
    q = np.zeros(6)
    for error in (chasles.InputTypeError, chasles.InputValueError):
        assert issubclass(error, chasles.InputError)
    assert not issubclass(chasles.InputValueError, TypeError)
    with pytest.raises(ValueError, match="components must be"):
        arm.manipulability(q, components="none")
    with pytest.raises(ValueError, match="max_evaluations"):
        arm.ik_numeric(np.eye(4), max_evaluations=0)
    with pytest.raises(ValueError, match="max_step"):
        arm.ik_path([np.eye(4)], q, max_step=0)
    with pytest.raises(TypeError, match="previous and dt"):
        arm.joint_rates(q, q, acceleration_limits=1.0)
    with pytest.raises(TypeError, match="real numbers"):
        arm.joint_rates(q, ["a"] * 6)


# ------------------------------------------------------------------ labels


def test_labels_name_the_mirrored_part():
    arm = chasles.load("ur5e")
    q = np.array([0.3, -1.2, 1.5, -0.4, 0.9, 0.2])
    solutions = arm.ik(arm.fk(q))
    labels = arm.labels["ik"]
    assert solutions.labels == labels
    assert len(labels) == len(set(labels)) == 8
    pairs = [
        (k, labels.index(label.replace("elbow +", "elbow -")))
        for k, label in enumerate(labels)
        if label.endswith("elbow +") and "wrist_1 +, elbow +" in label
    ]
    assert len(pairs) == 2
    elbow = [c.name for c in arm.coordinates].index("elbow")
    for one, other in pairs:
        assert solutions.q[one, elbow] * solutions.q[other, elbow] < 0
        assert solutions.q[one, 0] == solutions.q[other, 0]


def test_labels_follow_slots_through_solution_filters():
    arm = chasles.load("ur5e")
    solutions = arm.ik(arm.fk(np.full(6, 0.4)))
    wound = solutions.within_limits()
    times = wound.valid.shape[-1] // 8
    assert wound.labels == tuple(label for label in solutions.labels for _ in range(times))
    assert solutions.distinct().labels == solutions.labels
    # After sorting, the order of the solution slots differs from pose to pose.
    assert solutions.sorted_by_distance(np.zeros(6)).labels == ()


@pytest.mark.parametrize(
    ("name", "function", "method"),
    [
        ("excavator", "chain_all", "chain_branches"),
        ("delta", "actuators_all", "actuator_branches"),
    ],
)
def test_branches_of_loops_have_labels(name, function, method):
    robot = chasles.load(name)
    labels = robot.labels[method]
    assert len(labels) == len(set(labels)) == robot.functions[function].outputs[0].shape[0]
    first = labels[0].split(", ")
    # The first two labels differ only in the last branch choice.
    second = labels[1].split(", ")
    assert [a == b for a, b in zip(first, second, strict=True)] == [True] * (len(first) - 1) + [
        False
    ]
    names = {part.rpartition(" ")[0] for part in first}
    assert names <= {*robot.loops}
    text = robot.functions[function].__doc__
    assert re.search(rf"Slots:\n    0: {re.escape(labels[0])}\n", text)


def test_help_of_the_class_names_the_help_of_a_loaded_robot():
    text = pydoc.plain(pydoc.render_doc(chasles.Robot.fk))
    assert "fk(...)\n    Generated function of the robot." in text
    assert "`help(robot.fk)`" in text


ALONE = {"swivel"}
"""Functions that exist only for one family of arms.

If a robot lacks a function in `ALONE`, the error suggests no substitute."""


@pytest.mark.parametrize("name", ["ur5e", "four_bar", "excavator", "delta", "stewart_gough"])
def test_missing_attribute_error_states_reason_or_substitute(name):
    robot = chasles.load(name)
    owned = {key: item for owner in type(robot).__mro__ for key, item in vars(owner).items()}
    missing = [
        key for key, item in owned.items() if type(item) is Capability and key not in dir(robot)
    ]
    assert len(missing) > 10
    for key in missing:
        with pytest.raises(AttributeError) as caught:
            getattr(robot, key)
        stated = str(caught.value).split("; nearest functions")[0]
        assert ": " in stated or "; instead: " in stated or key in ALONE, stated


@pytest.mark.parametrize(
    ("robot", "name", "words"),
    [
        ("ur5e", "loops_close", "'loops_close': its q are its joints, since it has no loops;"),
        ("four_bar", "chain_fk", "has no 'chain_fk'; instead: fk;"),
        ("four_bar", "ik_planar", "it is not a platform on legs; instead: ik, actuators"),
        ("stewart_gough", "chain_branches", "its loops are solved by iteration; instead: chain"),
        ("five_bar", "fk_p", "chasles.load(..., parametric=True); instead: fk"),
        ("ur5e", "fk_p", "'fk_p': it is derived by chasles.load(..., parametric=True)"),
    ],
    ids=[
        "ur5e loops_close",
        "four_bar chain_fk",
        "four_bar ik_planar",
        "stewart_gough chain_branches",
        "five_bar fk_p",
        "ur5e fk_p",
    ],
)
def test_missing_attribute_error_names_reason_and_substitute(robot, name, words):
    with pytest.raises(AttributeError) as caught:
        getattr(chasles.load(robot), name)
    assert words in str(caught.value)


def test_ik_with_fixed_joints_without_inverse_names_substitute(robot):
    with pytest.raises(AttributeError, match=r"ik_numeric, .* with fixed= keeps joints at"):
        chasles.load("planar_3rrr").ik(np.eye(4), fixed={"x": 0.1})
    with pytest.raises(AttributeError, match="chasles derive FILE --fixed JOINTS"):
        robot.ik(np.eye(4), fixed={robot.coordinates[0].name: 0.1})
