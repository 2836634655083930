"""``.casadi`` files contain position equations. CasADi derives Jacobians and rates."""

import re

import casadi as ca
import numpy as np
import pytest

import chasles
from chasles import MissingFunctionError, UnknownRobotError
from chasles.contract import read_manifest
from chasles.derive import casadi_function, derive, files, read
from chasles.derive.emit.casadi_file import POSITIONS
from chasles.derive.terms.casadi_graph import lower
from tests.support.derivations import GENERATED, ROBOTS, SAMPLE, robot_of

DERIVATIVE = re.compile(r"jacobian|hessian|twist|acceleration|_rates|_D_|_dot$")
"""Pattern for the names of functions that CasADi derives from the other functions."""


def loaded(name):
    return ca.Function.load(str(GENERATED / name / f"{name}.casadi"))


@pytest.mark.parametrize("name", SAMPLE)
def test_casadi_file_contains_all_functions_except_derivatives(name):
    """A CasADi file omits functions with several outputs.

    Functions with several outputs combine other functions, or list the solution branches.
    """
    manifest = read_manifest(GENERATED / name)
    single = [f.name for f in manifest.functions if len(f.outputs) == 1]
    kept = [f for f in single if not DERIVATIVE.search(f) and f != "swivel"]
    if chasles.load(name).loop_solution == "newton":
        # If Newton's method closes the loops, only the C code computes the margin and accepts start
        # values.
        kept = [f for f in kept if f not in ("margin", "configuration_near")]
    assert loaded(name).name_out() == kept


def test_casadi_files_cover_every_position_role():
    kept = {name: set(loaded(name).name_out()) for name in SAMPLE}
    roles = {
        f.role.name
        for name in SAMPLE
        for f in read_manifest(GENERATED / name).functions
        if f.name in kept[name]
    }
    assert roles == POSITIONS


@pytest.mark.parametrize("name", SAMPLE)
def test_casadi_file_equals_compiled_functions(name):
    rng = np.random.default_rng(1)
    functions = derive(robot_of(name), functions=loaded(name).name_out()).functions
    for function, kernel in zip(functions, lower(functions, name), strict=True):
        if function.role.name not in POSITIONS or function.calls:
            continue
        kept = casadi_function(GENERATED / name, function.name)
        assert set(kept.name_in()) <= {argument.name for argument in function.inputs}
        values = {a.name: rng.uniform(-1, 1, a.size) for a in function.inputs}
        found = kept(**{key: values[key] for key in kept.name_in()})[function.name]
        expected = kernel(*values.values())
        np.testing.assert_array_equal(np.array(found).ravel(), np.array(expected).ravel())


def test_casadi_file_opens_without_chasles():
    function = loaded("ur5e")
    assert function.name_in() == ["q"]
    assert function.size_out("fk") == (4, 4)
    assert function.size_out("link_poses") == (6, 16)


def test_missing_casadi_function_or_file_is_reported():
    with pytest.raises(
        MissingFunctionError,
        match=r"ur5e\.casadi has no function 'jacobian_mixed'; functions: \['fk', ",
    ):
        casadi_function(GENERATED / "ur5e", "jacobian_mixed")
    with pytest.raises(UnknownRobotError, match=r"no \.casadi file"):
        casadi_function(GENERATED, "fk")


@pytest.mark.parametrize(
    ("functions", "there"),
    [(["fk", "twist_mixed"], True), (["fk_jacobian_mixed"], False)],
    ids=["with position", "derivative only"],
)
def test_derivatives_alone_write_no_casadi_file(functions, there):
    written = files(read(ROBOTS / "scara.toml"), functions=functions)
    assert ("scara.casadi" in written) == there
    assert "scara.c" in written


def test_casadi_function_of_a_description_equals_function_of_its_folder(tmp_path):
    path = tmp_path / "arm.toml"
    path.write_text((ROBOTS / "scara.toml").read_text())
    q = np.array([0.3, -0.7, 0.1, 1.2])
    expected = casadi_function("scara", "fk")(q)
    for robot in (path, str(path), read(path), GENERATED / "scara"):
        np.testing.assert_array_equal(casadi_function(robot, "fk")(q), expected)
    with pytest.raises(
        MissingFunctionError, match="expected a function of positions, got 'jacobian_mixed'"
    ):
        casadi_function(path, "jacobian_mixed")
