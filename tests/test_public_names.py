"""The public names of all modules agree with the committed page."""

import inspect
import re
import runpy
from importlib import import_module
from pathlib import Path

from chasles import derive

DOCS = Path(__file__).parents[1] / "docs"
SCRIPT = runpy.run_path(str(DOCS / "names.py"))


def listed(text: str) -> set[str]:
    """List each name on the page with the module or class that contains it."""
    found, module = set(), ""
    for part in re.split(r"\n(?:\n|(?=## ))", text):
        head = re.match(r"## (\S+)|\*\*(\w+)\*\*", part)
        module = head[1] if head and head[1] else module
        owner = f"{module}.{head[2]}" if head and head[2] else module
        found |= {f"{owner}.{name}" for name in re.findall(r"`(\w+)`", part)} | {owner}
    return found


def test_public_names_equal_the_committed_page():
    page, text = SCRIPT["PAGE"].read_text(encoding="utf-8"), SCRIPT["page"]()
    assert sorted(listed(text) - listed(page)) == [], "unlisted names: run python docs/names.py"
    assert sorted(listed(page) - listed(text)) == [], "missing names: run python docs/names.py"
    assert page == text, "run python docs/names.py"


def test_reference_documents_every_listed_module_and_name_of_the_compiler():
    pages = "".join(file.read_text() for file in (DOCS / "reference" / "api").glob("*.md"))
    documented = set(re.findall(r"^::: (\S+)", pages, re.MULTILINE))
    of_compiler = {f"chasles.derive.{name}" for name in derive.__all__}
    modules = {*SCRIPT["MODULES"]} - {"chasles.derive"}
    assert documented == of_compiler | modules | functions_in_a_module_of_their_name(modules)


def functions_in_a_module_of_their_name(modules):
    """Return paths such as "chasles.calibration.identify.identify".

    The page of a package omits these functions, so the reference names each of them.
    """
    values = [getattr(m, n) for m in map(import_module, modules) for n in SCRIPT["names_of"](m)]
    paths = {(value.__module__, value.__name__) for value in values if inspect.isfunction(value)}
    return {f"{path}.{name}" for path, name in paths if path.endswith(f".{name}")}


def test_names_that_only_raise_a_hint_are_not_listed():
    assert not {"chasles.Robot.fkine", "chasles.Robot.jacobian"} & listed(SCRIPT["page"]())
