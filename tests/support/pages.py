"""The pages of the documentation: their examples, headings and links."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(page.relative_to(DOCS).as_posix() for page in DOCS.rglob("*.md"))
"""The paths of all pages in the folder docs, such as "how-to/view.md"."""
_BLOCK = re.compile(r"^```(\w*)\n(.*?)^```", re.MULTILINE | re.DOTALL)


def text(page: str) -> str:
    """The text of a page; "../README.md" is the front page of the repository."""
    return (DOCS / page).read_text(encoding="utf-8")


def prose(page: str) -> str:
    """The text of a page without its blocks of code."""
    return _BLOCK.sub("", text(page))


def examples(page: str, language: str = "python") -> list[str]:
    """The blocks of a language on a page, in order."""
    return [block for name, block in _BLOCK.findall(text(page)) if name == language]


def run(page: str, names: dict | None = None) -> dict:
    """Runs the Python blocks of a page in order; returns the names that they define."""
    names = {} if names is None else names
    blocks = examples(page)
    assert blocks, page
    for block in blocks:
        exec(compile(block, page, "exec"), names)
    return names


def anchors(page: str) -> set[str]:
    """The fragments that links to a page may name: its headings and its named anchors."""
    without_code = prose(page)
    titles = re.findall(r"^#+ (.*)$", without_code, re.MULTILINE)
    return {*map(_slug, titles), *re.findall(r'<a name="([^"]+)">', without_code)}


def _slug(title: str) -> str:
    """The anchor of a heading, by the rule of Python-Markdown's table of contents."""
    plain = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", title)
    return re.sub(r"[-\s]+", "-", re.sub(r"[^\w\s-]", "", plain).strip().lower())


def links(page: str) -> list[str]:
    """The targets of the links and pictures of a page within the repository."""
    without_code = re.sub(r"`[^`\n]*`", "", prose(page))
    targets = re.findall(r"\]\(([^)\s]+)\)", without_code)
    return [target for target in targets if not re.match(r"[a-z]+:", target)]
