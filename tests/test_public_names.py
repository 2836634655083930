"""The public names of all modules agree with the committed page."""

import re
import runpy
from pathlib import Path

from chasles import derive

DOCS = Path(__file__).parents[1] / "docs"
SCRIPT = runpy.run_path(str(DOCS / "names.py"))


def listed(text: str) -> set[str]:
    """Lists each name on the page with the module or class that contains it."""
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
    assert documented - of_compiler == {*SCRIPT["MODULES"]} - {"chasles.derive"}
    assert of_compiler <= documented


def test_names_that_only_raise_a_hint_are_not_listed():
    assert not {"chasles.Robot.fkine", "chasles.Robot.jacobian"} & listed(SCRIPT["page"]())
