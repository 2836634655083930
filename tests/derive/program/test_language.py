"""Test a new output language: functions in plain Python with ``math`` agree with C functions."""

import json
import runpy
from functools import cache

import numpy as np
import pytest

import chasles
from chasles import InputValueError
from chasles.derive import read, write
from chasles.derive.build.generate import files
from chasles.derive.emit.emitter import Emitter
from chasles.derive.emit.languages import EMITTERS, with_detail
from chasles.derive.program.operations import Compute, Constant, Input, Operation
from tests.support.compiling import loaded
from tests.support.derivations import ROBOTS, derivation, made

TEMPLATES = {
    Operation.ADD: "{0} + {1}",
    Operation.SUBTRACT: "{0} - {1}",
    Operation.MULTIPLY: "{0} * {1}",
    Operation.DIVIDE: "{0} / {1} if {1} else math.nan",
    Operation.SQUARE: "{0} * {0}",
    Operation.NEGATE: "-{0}",
    Operation.SQRT: "math.sqrt({0}) if {0} >= 0 else math.nan",
    Operation.SIN: "math.sin({0})",
    Operation.COS: "math.cos({0})",
    Operation.TAN: "math.tan({0})",
    Operation.ATAN: "math.atan({0})",
    Operation.ATAN2: "math.atan2({0}, {1})",
    Operation.ABS: "abs({0})",
    Operation.SIGN: "math.copysign(1.0, {0}) if {0} else {0}",
    Operation.MIN: "min({0}, {1})",
    Operation.MAX: "max({0}, {1})",
    Operation.LESS: "{0} < {1}",
    Operation.LESS_EQUAL: "{0} <= {1}",
    Operation.EQUAL: "{0} == {1}",
    Operation.NOT_EQUAL: "{0} != {1}",
    Operation.NOT: "not {0}",
    Operation.AND: "bool({0} and {1})",
    Operation.OR: "bool({0} or {1})",
    Operation.SELECT: "{1} if {0} else {2}",
}


def text(program, operand):
    match operand:
        case Constant(value):
            return f"({value!r})"
        case Input(argument, entry):
            return f"{program.arguments[argument]}[{entry}]"
        case _:
            return f"v{operand.number}"


def printed(name, program):
    """Print a Python function with flat input and output sequences."""
    sizes = [
        1 + max(s.entry for s in program.stored if s.output == k)
        for k in range(len(program.results))
    ]
    lines = [f"def {name}({', '.join(program.arguments)}):"]
    lines += [f"    {r} = [None] * {n}" for r, n in zip(program.results, sizes, strict=True)]
    for statement in program.statements:
        terms = [text(program, operand) for operand in statement.operands]
        if isinstance(statement, Compute):
            right = TEMPLATES[statement.operation].format(*terms)
            lines.append(f"    v{statement.result.number} = {right}")
        else:
            lines.append(f"    {program.results[statement.output]}[{statement.entry}] = {terms[0]}")
    return "\n".join([*lines, f"    return [{', '.join(program.results)}]", ""])


def plain_python(derivation, programs):
    parts = ["import math", *(printed(name, p) for name, p in programs.whole.items())]
    return {f"plain/{derivation.robot.name}_plain.py": "\n\n".join(parts)}


EMITTER = Emitter("plain python", plain_python)
RUN = ("c", "python")
"""Languages whose code the test executes; deriving the other languages takes most of the time."""


@cache
def plain_functions(name):
    (source,) = plain_python(derivation(name), made(name)).values()
    namespace = {}
    exec(source, namespace)
    return namespace


def assert_same_values(robot, plain, q):
    """Compare Python functions with C functions, and return the number of compared functions."""
    rng = np.random.default_rng(3)
    given = {"q": q, "qd": rng.uniform(-1, 1, robot.n), "qdd": rng.uniform(-1, 1, robot.n)}
    given["T"] = robot.fk(q)
    compared = 0
    by_hand = {"modes"}
    assert robot.functions.keys() - plain.keys() <= by_hand
    for name, function in robot.functions.items():
        if name in by_hand:
            continue
        arguments = plain[name].__code__.co_varnames[: plain[name].__code__.co_argcount]
        if not set(arguments) <= given.keys() or name == "ik":
            continue
        expected = function(*(given[a] for a in arguments))
        expected = expected if isinstance(expected, tuple) else (expected,)
        found = plain[name](*(np.ravel(given[a]).tolist() for a in arguments))
        for ours, theirs in zip(found, expected, strict=True):
            np.testing.assert_allclose(ours, np.ravel(theirs), rtol=1e-12, atol=1e-12, err_msg=name)
        compared += 1
    return compared


@pytest.mark.parametrize("name", ["ur5e", "five_bar"])
def test_added_language_computes_the_same_values_as_c(name):
    robot = chasles.load(name)
    q = (
        np.array(robot.reference.q)
        if name != "ur5e"
        else np.array([0.3, -1.1, 1.2, 0.4, 0.9, -0.5])
    )
    assert assert_same_values(robot, plain_functions(name), q) >= 14


def test_written_files_of_added_language_compute_the_same_values_as_c(tmp_path):
    folder = tmp_path / "scara"
    write(read(ROBOTS / "scara.toml"), folder, languages=(*RUN, EMITTER))
    plain = runpy.run_path(str(folder / "plain" / "scara_plain.py"))
    q = np.random.default_rng(5).uniform(-1, 1, 4)
    assert assert_same_values(loaded(folder), plain, q) >= 14


def test_added_language_returns_every_inverse_branch():
    robot = chasles.load("ur5e")
    T = robot.fk([0.3, -1.1, 1.2, 0.4, 0.9, -0.5])
    found = robot.ik(T)
    q, residual, margin = plain_functions("ur5e")["ik"](T.ravel().tolist())
    np.testing.assert_allclose(np.reshape(q, (8, 6)), found.q, atol=1e-12)
    np.testing.assert_allclose(margin, found.margin, atol=1e-12)
    assert max(residual) < 1e-13


def test_files_of_added_language_are_listed_and_later_removed(tmp_path):
    folder = tmp_path / "scara"
    write(read(ROBOTS / "scara.toml"), folder, functions=["fk"], languages=(*EMITTERS, EMITTER))
    manifest = json.loads((folder / "manifest.json").read_text())
    name = f"plain/{manifest['name']}_plain.py"
    assert manifest["languages"]["plain python"] == [name]
    assert name in manifest["files"]
    assert set(manifest["languages"]) == {e.language for e in (*EMITTERS, EMITTER)}
    own = folder / "plain" / "notes.py"
    own.write_text("")
    write(read(ROBOTS / f"{manifest['name']}.toml"), folder, functions=["fk"])
    assert not (folder / name).exists()
    assert own.exists()
    assert "plain python" not in json.loads((folder / "manifest.json").read_text())["languages"]


def test_two_languages_may_not_write_the_same_file(tmp_path):
    twice = (*RUN, Emitter("another c", lambda derivation, programs: {"scara.c": ""}))
    with pytest.raises(
        InputValueError,
        match=r"another c: another language has files with the same path: scara\.c",
    ):
        write(read(ROBOTS / "scara.toml"), tmp_path, functions=("fk",), languages=twice)
    assert not list(tmp_path.iterdir())


def test_omitting_the_article_changes_no_other_file():
    robot = read(ROBOTS / "four_bar.toml")
    whole, plain = (
        files(robot, functions=["fk"], languages=with_detail(EMITTERS, detail))
        for detail in ("full", "none")
    )
    assert {name for name in whole if name.endswith(".tex")} == whole.keys() - plain.keys()
    facts = [json.loads(made.pop("manifest.json")) for made in (whole, plain)]
    assert plain.items() <= whole.items()
    assert facts[0]["functions"] == facts[1]["functions"]
    assert {key for key in facts[0] if facts[0][key] != facts[1][key]} == {"files", "languages"}
