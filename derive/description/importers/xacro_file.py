"""Xacro: macros, properties, includes and arguments are expanded to the XML that they stand for."""

import io
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any
from xml.dom import minidom
from xml.parsers.expat import ExpatError

from ..toml_file import DescriptionError
from .robot_xml import read_xml
from .xacro_hints import incomplete, missing

ARGUMENT = re.compile(r"([A-Za-z_]\w*):=(.*)", re.DOTALL)
CLASS = re.compile(r"<class '[\w.]+'>: ")
"""The name of an error's class, which xacro puts before its words."""
TWICE = re.compile(r"(?<!\S)(\S.{7,}) \1(?!\S)")
"""The words of an error that xacro has wrapped in another."""
PACKAGE_FILE = "package.xml"
PACKAGE_ENDINGS = ("_description", "_support")
FOLDERS_UP = 5
"""Folders above a file in which and beside which the packages that it names are looked for."""
NEEDS_XACRO = "the package xacro, to expand it (pip install 'chasles[files]')"


def is_xacro(file: Path) -> bool:
    """Whether a file's name says that it is xacro."""
    return file.suffix.lower() == ".xacro"


def expanded(file: Path, arguments: Sequence[str]) -> str:
    """The XML that a xacro file stands for.

    ``$(find package)`` is looked for in the folders above the file and beside them, then in ROS: a
    package is a folder with a package.xml of that name, or a folder of that name, where endings of
    ``PACKAGE_ENDINGS`` do not count.

    Args:
        file: A xacro file.
        arguments: Values of its arguments, each as ``name:=value``.

    Raises:
        DescriptionError: The file cannot be expanded, or is no robot but a part of one; the error
            has xacro's reason, and says what is missing.
    """
    try:
        import xacro  # noqa: PLC0415
        from xacro import substitution_args  # noqa: PLC0415
    except ModuleNotFoundError as error:
        raise DescriptionError(str(file), None, "", None, NEEDS_XACRO) from error
    read_xml(file)
    values = arguments_of(file, arguments)
    said = io.StringIO()
    before = len(xacro.all_includes)
    try:
        with (
            redirect_stdout(said),
            redirect_stderr(said),
            _packages_found(substitution_args, file),
        ):
            document = xacro.process_file(str(file), mappings=values)
    except Exception as error:
        # The file's own expressions may raise any error, and xacro raises several of its own.
        known = isinstance(error, xacro.XacroException | substitution_args.SubstitutionException)
        reason = str(error) if known and str(error) else f"{type(error).__name__}: {error}"
        raise _refused(file, reason, xacro.filestack) from error
    lacking = incomplete(document.documentElement, file, xacro.all_includes[before:])
    if lacking:
        raise DescriptionError(str(file), None, "", None, lacking)
    return str(document.toprettyxml(indent="  "))


def arguments_of(file: Path, arguments: Sequence[str]) -> dict[str, str]:
    """The names and values of ``name:=value`` words.

    Raises:
        DescriptionError: A word is none.
    """
    found = {}
    for word in arguments:
        match = ARGUMENT.fullmatch(word)
        if match is None:
            raise DescriptionError(str(file), None, "xacro argument", word, "name:=value")
        found[match[1]] = match[2]
    return found


def _refused(file: Path, reason: str, stack: Sequence[str | None] | None) -> DescriptionError:
    """The error that names the file in which the expansion stopped, and the line if it is known."""
    inner = next((name for name in reversed(stack or []) if name), str(file))
    line = re.search(r"line (\d+)", reason)
    within = "" if inner == str(file) else f", included by {file}"
    reason = TWICE.sub(r"\1", " ".join(CLASS.sub("", reason).split()))
    hint = missing(reason, Path(inner))
    expected = f"xacro that can be expanded ({reason}{within}{hint})"
    return DescriptionError(inner, int(line[1]) if line else None, "", None, expected)


@contextmanager
def _packages_found(substitution_args: Any, file: Path) -> Iterator[None]:
    """Lets ``$(find package)`` find packages around a file while it is expanded.

    xacro has no argument for it: it asks the index of an installed ROS alone.
    """
    of_ros = substitution_args._eval_find
    around = _Packages(file.resolve())

    def found(name: str) -> str:
        folder = around.folder(name)
        if folder is not None:
            return str(folder)
        try:
            return str(of_ros(name))
        except Exception as error:
            # Where there is no ROS, or where another package has put its own finder in its place.
            raise substitution_args.SubstitutionException(around.missed(name)) from error

    substitution_args._eval_find = substitution_args._eval_dict["find"] = found
    try:
        yield
    finally:
        substitution_args._eval_find = substitution_args._eval_dict["find"] = of_ros


class _Packages:
    """The packages around a file, by name."""

    def __init__(self, file: Path) -> None:
        self.above = list(file.parents)[:FOLDERS_UP]

    def folder(self, name: str) -> Path | None:
        """The folder of a package; None where it is not around the file."""
        stem = _stem(name)
        rules = ((self._declared, name), (self._named, name), (self._named_nearly, stem))
        for known, sought in rules:
            for folder in self.above:
                if sought in (there := known(folder)):
                    return there[sought]
        return None

    def missed(self, name: str) -> str:
        """Where a package was looked for, in words."""
        return (
            f"no package {name!r} in {self.above[0]} and {FOLDERS_UP - 1} folders above it, nor in "
            f"ROS: put the package there, as a folder {name}"
        )

    def _declared(self, folder: Path) -> Mapping[str, Path]:
        """The packages that declare their name: the folder itself and those in it."""
        files = [folder / PACKAGE_FILE, *sorted(folder.glob(f"*/{PACKAGE_FILE}"))]
        return {_package_name(file): file.parent for file in files if file.is_file()}

    def _named(self, folder: Path) -> Mapping[str, Path]:
        inner = (path for path in sorted(folder.iterdir()) if path.is_dir())
        return {folder.name: folder} | {path.name: path for path in inner}

    def _named_nearly(self, folder: Path) -> Mapping[str, Path]:
        return {_stem(name): path for name, path in self._named(folder).items()}


def _stem(name: str) -> str:
    return next((name.removesuffix(end) for end in PACKAGE_ENDINGS if name.endswith(end)), name)


def _package_name(file: Path) -> str:
    try:
        names = minidom.parse(str(file)).getElementsByTagName("name")
    except (ExpatError, OSError):
        return file.parent.name
    text = names[0].firstChild if names else None
    return str(text.nodeValue).strip() if text else file.parent.name
