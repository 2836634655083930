"""Documented xacro expressions evaluate as in Python.

No xacro expression runs a command.
"""

import math

import pytest

from chasles.derive import DescriptionError
from chasles.derive.description.importers import xacro_expressions
from chasles.derive.description.importers.xacro_expressions import RefusedExpressionError, evaluate
from chasles.derive.description.importers.xacro_file import expanded

FUNCTIONS = {
    **{f.__name__: f for f in (list, dict, map, len, str, float, int, min, max, round, sorted)},
    **{name: value for name, value in vars(math).items() if not name.startswith("_")},
}
VALUES = {"prefix": "left_", "length": 0.25, "axes": [1, 2, 3], "table": {"a": {"b": 7}}}
DOCUMENTED = (
    "2 * pi / 3 + length**2 - -1",
    "radians(45) if prefix == 'left_' else sin(0.3)",
    "prefix + 'link' + str(axes[-1])",
    "table['a']['b'] // 2 % 2",
    "not (1 < length <= 2) and 3 in axes or 'x' not in prefix",
    "[2 * a for a in axes if a > 1] + list(map(float, '1 2'.split()))",
    "{k: v for k, v in dict(a=1, b=2).items()}",
    "f'{length:.3f} {prefix!r}' + '%d' % 3",
    "max(*axes, 5) << 2 | 1",
    "prefix.replace('left', 'right').upper()[1:4:2]",
    "sum_of if False else sorted(axes, key=float)[0]",
    "(len(axes), {1, 2}, None is not None)",
)
HOSTILE = (
    "__import__('os').system('touch {mark}')",
    "().__class__.__base__.__subclasses__()",
    "[c for c in ().__class__.__mro__][0]",
    "(lambda: 1).__globals__",
    "(lambda x: x)(1)",
    "'{0.__class__}'.format(1)",
    "str.format('{0.__class__}', 1)",
    "math.__loader__.load_module('os').system('touch {mark}')",
    "python.type('X', (), {})",
    "python.vars(xacro)",
    "python['vars'](str)",
    "python.get('type')('X', (), {})",
    "python.root['python']['vars'](str)",
    "list(map(list, map(map, [v for k, v in python.items() if k == 'vars'], [[str]])))[0][0]",
    "[f(str) for k, f in python.items() if k == 'vars'][0]",
    "max([python['vars']])(str)",
    "xacro.load_yaml.__globals__['os'].system('touch {mark}')",
    "load_yaml.__globals__",
    "getattr(str, 'mro')",
    "open('{mark}', 'w')",
    "exec('import os')",
    "table.fromkeys([1])",
    "(x := 1)",
    "'a' * 10**9",
    "b'a' * 10**9",
    "'%1000000000d' % 1",
    "'%.*f' % (10**9, 1.5)",
    "f'{1:1000000000}'",
    "f'{1.5:.{10**9}f}'",
    "9**9**9",
    "1 << 10**9",
    "[0 for a in '" + "x" * 200 + "' for b in '" + "y" * 200 + "']",
)
DOCUMENT = """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
<xacro:property name="value" value="{}"/><link name="a"/><link name="b"/>
<joint name="j" type="revolute"><parent link="a"/><child link="b"/>
<origin xyz="0 0 1" rpy="0 0 0"/><axis xyz="0 0 1"/><limit lower="-1" upper="${{value}}"/></joint>
</robot>"""


@pytest.mark.parametrize("text", DOCUMENTED)
def test_documented_expressions_have_python_values(text):
    functions = {value for value in FUNCTIONS.values() if callable(value)}
    expected = eval(text, {"__builtins__": {}}, {**FUNCTIONS, **VALUES})
    assert evaluate(text, {**FUNCTIONS, **VALUES}, functions) == expected


@pytest.mark.parametrize("text", HOSTILE)
@pytest.mark.parametrize("form", ["${{{}}}", "$(eval {})"], ids=["braces", "eval"])
def test_hostile_expressions_are_refused(text, form, tmp_path, monkeypatch):
    monkeypatch.setattr(xacro_expressions, "MAX_STEPS", 20_000)
    mark = tmp_path / "mark"
    text = form.format(text.replace("{mark}", str(mark)))
    file = tmp_path / "arm.xacro"
    escaped = text.replace("&", "&amp;").replace("<", "&lt;").replace('"', "&quot;")
    file.write_text(DOCUMENT.format(escaped))
    with pytest.raises(DescriptionError, match="xacro that can be expanded"):
        expanded(file, ())
    assert not mark.exists()


def test_modules_of_xacro_are_as_before_an_expansion(tmp_path):
    xacro = pytest.importorskip("xacro")
    file = tmp_path / "arm.xacro"
    file.write_text(DOCUMENT.format("${1 + 1}"))
    before = xacro.safe_eval
    assert 'upper="2"' in expanded(file, ())
    assert xacro.safe_eval is before


def test_long_expressions_end(monkeypatch):
    monkeypatch.setattr(xacro_expressions, "MAX_STEPS", 1000)
    with pytest.raises(RefusedExpressionError, match="1000 steps"):
        evaluate("[a for a in axes]", {"axes": range(2000)}, ())
