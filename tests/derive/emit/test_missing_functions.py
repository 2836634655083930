"""The code in each language contains all public functions, or names the missing functions."""

import re

import pytest

import chasles
from chasles.derive import derive
from chasles.derive.build.generate import files_of
from chasles.derive.emit.languages import ON_DEMAND
from chasles.derive.emit.seeds import seeded
from tests.support.derivations import robot_of

ROBOTS = ["ur5e", "planar_3rrr", "jaco2"]
"""Names of an arm with a closed-form inverse kinematics function, and of two robots with iterative
solvers in C."""
PRINTED = {
    "c_float": ("{robot}_float.h", r"^void {robot}_float_{function}\("),
    "rust": ("src/lib.rs", r"^pub fn {function}\("),
    "cuda": ("{robot}.cuh", r"\b{function}_kernel\("),
    "jax": ("{robot}_jax.py", r"^def {function}\("),
    "casadi_c": ("{robot}_casadi.c", r"\b{robot}_{function}\(const casadi_real\*\* arg"),
    "cpp": ("include/chasles/{robot}.hpp", r"^inline .*\b{function}\("),
    "mex": ("src/{robot}_functions.h", r"\bcall_{function}\("),
    "moveit": ("include/chasles_{robot}_moveit/{robot}.h", r"^void {robot}_{function}\("),
}
"""For each output language, the file with the public functions and the pattern of a function
declaration."""
SELECTING = ("rust", "cuda")
"""Output languages with their own functions for the solution nearest to a seed configuration."""
COMPLETE = ("cpp", "mex", "moveit")
"""Output languages that call the C code of a robot, which contains all functions."""
MISSING = {"planar_3rrr": "fk", "jaco2": "ik"}
"""For each robot, a function that calls an iterative solver."""
MISSING_IN_CASADI = {"ur5e": "ik", "planar_3rrr": "twist_mixed", "jaco2": "ik"}
"""For each robot, a function that the CasADi file lacks, because the function has several branches
or depends on loops without a closed form."""


def test_all_languages_are_tested():
    assert PRINTED.keys() == ON_DEMAND.keys()


@pytest.mark.parametrize("name", ROBOTS)
def test_each_function_is_printed_or_named_as_missing(name):
    derivation = derive(robot_of(name), functions=one_of_each_role(name))
    functions = (*derivation.functions, *derivation.written)
    public = {function.name for function in functions if not function.role.is_intermediate}
    nearest = {f"{inverse.name}_nearest" for inverse in seeded(derivation)}
    for language, (file, pattern) in PRINTED.items():
        if (language, name) == ("moveit", "planar_3rrr"):
            continue
        files = files_of(derivation, (ON_DEMAND[language],))
        text = files[file.format(robot=name)]
        names = public | (nearest if language in SELECTING else set())
        printed = {
            function
            for function in names
            if re.search(pattern.format(robot=name, function=function), text, re.MULTILINE)
        }
        named = named_as_missing(text)
        assert printed | named == names, language
        assert not printed & named, language
        missing = MISSING_IN_CASADI if language == "casadi_c" else MISSING
        is_missing = language not in COMPLETE and name in missing
        assert (missing.get(name) in named) == is_missing, language


def one_of_each_role(name):
    robot = chasles.load(name)
    each = {info.role.name: info.name for info in robot.manifest.functions}
    chosen = {*each.values(), MISSING_IN_CASADI[name], MISSING.get(name, "fk")}
    return sorted(chosen & {*robot.functions})


def named_as_missing(text):
    """Return the names of missing functions that the header of a generated file lists."""
    sentences = re.sub(r"\n *(\*|//!)? *", " ", text)
    return {
        function
        for names in re.findall(r"Only in [\w ]+, because [^:]+: ([\w, ]+)\.", sentences)
        for function in names.split(", ")
    }
