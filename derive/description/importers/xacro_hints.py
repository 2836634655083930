"""Finds out why a part of a xacro file is missing, such as an argument, a macro or a link.

The hint names a nearby file that defines the missing part.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from xml.dom import minidom

from chasles.contract.errors import DescriptionError

from ..file_text import read_bytes
from .robot_xml import nearby_document

MAX_FILES = 300
"""Maximum number of searched files."""
MAX_NAMES = 3
NEARBY = ((0, "*.xacro"), (1, "*.xacro"), (1, "*/*.xacro"), (2, "*/*/*.xacro"))
"""Places to search for files: the number of folders to go up, and a file pattern."""
DEFINED = r"<{kind}\b[^>]*\bname\s*=\s*[\"'](xacro:)?{name}[\"']"
INCLUDED = r"<xacro:include\b[^>]*[\"'/]{name}[\"']"


@dataclass(frozen=True)
class _Macro:
    """A macro: its name, required parameters, block parameters, and whether it creates links."""

    name: str
    parameters: tuple[str, ...]
    blocks: tuple[str, ...]
    makes_links: bool

    def __str__(self) -> str:
        given = "".join(f' {name}="..."' for name in self.parameters)
        inside = "".join(f"<{name}/>" for name in self.blocks)
        opened = f"<xacro:{self.name}{given}"
        return f"{opened}>{inside}</xacro:{self.name}>" if inside else f"{opened}/>"


def missing(reason: str, file: Path) -> str:
    """Return a hint on how to fix a failed expansion, or "" if no fix is known.

    Args:
        reason: The error message of xacro.
        file: The file in which the expansion stopped.
    """
    argument = re.search(r"Undefined substitution argument (\w+)", reason)
    if argument:
        return f"; set {argument[1]}:=value"
    parameters = re.search(r"Undefined parameters \[(.*?)\]", reason)
    if parameters:
        return f"; the macro call must set {parameters[1].replace(',', ', ')}"
    if "Not enough blocks" in reason:
        return "; the macro call must contain an element for each * parameter"
    for kind, words in (
        ("property", r"name '(\w+)' is not defined"),
        ("macro", r"unknown macro name: xacro:(\w+)"),
    ):
        found = re.search(words, reason)
        if found:
            return _undefined(kind, found[1], file)
    return ""


def _undefined(kind: str, name: str, file: Path) -> str:
    tag = f'<xacro:{kind} name="{name}">'
    having = _with(DEFINED.format(kind=f"xacro:{kind}", name=re.escape(name)), file)
    if any(path == file.resolve() for path in having):
        return f"; {tag} is defined after its use, or in another scope"
    if having:
        return f"; no {tag} is included: it is in {_shown(having)}"
    bare = _with(DEFINED.format(kind=kind, name=re.escape(name)), file)
    if bare:
        return f'; {_shown(bare)} has <{kind} name="{name}"> without the prefix xacro:'
    return f"; no {tag} is included, and none is near the file"


def incomplete(root: minidom.Element, file: Path, includes: Sequence[str]) -> str:
    """Return a text that names the missing parts of a robot, or "" if nothing is missing.

    Args:
        root: The root element of the expanded XML.
        file: The file.
        includes: The included files.
    """
    links = {link.getAttribute("name") for link in _children(root, "link")}
    if not links:
        return _without_links(file, includes)
    joints = _children(root, "joint")
    parents = [end.getAttribute("link") for joint in joints for end in _children(joint, "parent")]
    absent = next((parent for parent in parents if parent not in links), None)
    users = _with(INCLUDED.format(name=re.escape(file.name)), file) if absent else []
    if not users:
        return ""
    return (
        f"a whole robot; this part needs the missing link {absent}: derive "
        f"{_shown(users)}, which includes it"
    )


def _without_links(file: Path, includes: Sequence[str]) -> str:
    own = _macros(file)
    users = _with(INCLUDED.format(name=re.escape(file.name)), file)
    if own and users:
        return f"links; the file only defines macros: derive {_shown(users)}, which includes it"
    if own:
        return f"links; the file only defines macros: derive a file that calls one, as {own[0]}"
    for path in map(Path, includes):
        others = _macros(path)
        if others:
            return f"links; the file includes {path.name} and calls no macro of it: add {others[0]}"
    return "links; the file has no links and defines no macro that creates links"


def _macros(file: Path) -> list[_Macro]:
    """Return those macros of a file that create links.

    If no macro creates links, all macros are returned.
    """
    document = nearby_document(file)
    elements = document.getElementsByTagName("xacro:macro") if document else []
    found = [
        _Macro(
            element.getAttribute("name").removeprefix("xacro:"),
            tuple(re.findall(r"(?<!\S)\w+(?!\S)", element.getAttribute("params"))),
            tuple(re.findall(r"\*(\w+)", element.getAttribute("params"))),
            bool(element.getElementsByTagName("link")),
        )
        for element in elements
    ]
    return [macro for macro in found if macro.makes_links] or found


def _children(element: minidom.Element, tag: str) -> list[minidom.Element]:
    nodes = (node for node in element.childNodes if isinstance(node, minidom.Element))
    return [node for node in nodes if node.tagName == tag]


def _with(pattern: str, file: Path) -> list[Path]:
    sought = re.compile(pattern, re.DOTALL)
    folder = file.resolve().parent
    for up, paths in NEARBY:
        place = folder.parents[up - 1] if 0 < up <= len(folder.parents) else folder
        having = [
            path for path in files_like(place, paths, MAX_FILES) if sought.search(_text(path))
        ]
        if having:
            return having
    return []


def files_like(folder: Path, pattern: str, maximum: int | None = None) -> list[Path]:
    """Return the files that match a pattern. The list is empty if the folder cannot be read."""
    try:
        return sorted(islice(folder.glob(pattern), maximum))
    except OSError:
        return []


def _text(path: Path) -> str:
    try:
        return read_bytes(path).decode(errors="replace")
    except DescriptionError:
        return ""


def _shown(paths: Sequence[Path]) -> str:
    more = len(paths) - MAX_NAMES
    names = " or ".join(str(path) for path in paths[:MAX_NAMES])
    return f"{names}{f' or {more} more' if more > 0 else ''}"
