"""The compiler's output does not depend on the date, the host or the directory."""

import ast
from functools import cache
from pathlib import Path

import chasles.derive

ROOM = Path(chasles.derive.__file__).parent
FILES = sorted(ROOM.rglob("*.py"))
IMPURE = {"datetime", "random", "socket", "getpass", "platform", "uuid", "secrets"}
SIMPLIFIERS = {"simplify", "trigsimp", "nsimplify", "sympify", "parse_expr"}


@cache
def nodes(path):
    """Return the syntax nodes of all imports and calls in a Python file."""
    kinds = (ast.Import, ast.ImportFrom, ast.Call)
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return [node for node in ast.walk(tree) if isinstance(node, kinds)]


def imported(path):
    for node in nodes(path):
        if isinstance(node, ast.Import):
            yield from ((0, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.level, node.module or ""


def test_compiler_imports_no_impure_modules():
    for path in FILES:
        depth = len(path.relative_to(ROOM).parts)
        for level, module in imported(path):
            assert level <= depth, f"{path.name} reaches out of the room by {'.' * level}{module}"
            assert module.split(".")[0] not in IMPURE, f"{path} imports {module}"


def test_compiler_never_calls_eval_exec_or_simplifiers():
    for path in FILES:
        called = {
            node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            for node in nodes(path)
            if isinstance(node, ast.Call)
        }
        assert not called & {"eval", "exec", *SIMPLIFIERS}, path


def test_more_than_200_compiler_files_are_checked():
    assert len(FILES) > 200
