"""Expands the macros, properties, includes and arguments of xacro files."""

import io
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

from chasles.contract.errors import DescriptionError, NotInstalledError
from chasles.contract.input_files import FOLDERS_UP, PACKAGE_FILE, input_folder

from ..file_text import included_bytes
from ..toml_file import file_error
from .robot_xml import nearby_document, read_xml
from .xacro_expressions import (
    allowed_symbols,
    expression_evaluator,
    replaced,
    substitution_evaluator,
)
from .xacro_hints import files_like, incomplete, missing

ARGUMENT = re.compile(r"([A-Za-z_]\w*):=(.*)", re.DOTALL)
CLASS = re.compile(r"<class '[\w.]+'>: ")
"""Name of the error class, which xacro prints before its message."""
TWICE = re.compile(r"(?<!\S)(\S.{7,}) \1(?!\S)")
"""Matches a text that occurs twice in a row. Xacro repeats the message of a nested error."""
MAX_REASON = 2000
"""Maximum length of an error message from xacro."""
PACKAGE_ENDINGS = ("_description", "_support")
NEEDS_XACRO = "the package xacro, to expand it (pip install 'chasles[files]')"


def is_xacro(file: Path) -> bool:
    """Whether the suffix of the file is .xacro."""
    return file.suffix.lower() == ".xacro"


def expanded(file: Path, arguments: Sequence[str]) -> str:
    """Return the XML text of a xacro file. See ``expanded_with_files``."""
    return expanded_with_files(file, arguments)[0]


def expanded_with_files(file: Path, arguments: Sequence[str]) -> tuple[str, list[Path]]:
    """Expand a xacro file to XML, and list its included files.

    ``$(find package)`` is searched in the parent folders of the file and their subfolders, and then
    in an installed ROS. The folder of a package has the name of the package, or contains a
    package.xml with this name. Package names are compared without the suffixes of
    ``PACKAGE_ENDINGS``. Included files and YAML files must belong to the package of the xacro file,
    or to a package that ``$(find package)`` names. Without a package.xml, the package is the folder
    of the file.

    Args:
        file: A xacro file.
        arguments: Argument values, each as ``name:=value``.

    Raises:
        DescriptionError: The file cannot be expanded, or the robot is incomplete. The error
            contains the message of xacro and names the missing part.
    """
    try:
        import xacro  # noqa: PLC0415
        from xacro import substitution_args  # noqa: PLC0415
    except ModuleNotFoundError as error:
        raise NotInstalledError(f"{file}: expected {NEEDS_XACRO}") from error
    read_xml(file)
    values = arguments_of(file, arguments)
    said = io.StringIO()
    before = len(xacro.all_includes)
    symbols = allowed_symbols(xacro._global_symbols)
    evaluator = expression_evaluator(symbols)
    packages = _Packages(file.resolve())
    try:
        with (
            redirect_stdout(said),
            redirect_stderr(said),
            _packages_found(substitution_args, packages),
            replaced(xacro, safe_eval=evaluator, _global_symbols=symbols, open=packages.opened),
            replaced(substitution_args, _eval=substitution_evaluator(substitution_args)),
        ):
            document = xacro.process_file(str(file), mappings=values)
    except DescriptionError:
        raise
    except Exception as error:
        # Expressions in the file may raise errors of any type.
        known = isinstance(error, xacro.XacroException | substitution_args.SubstitutionException)
        reason = str(error) if known and str(error) else f"{type(error).__name__}: {error}"
        raise _refused(file, reason, xacro.filestack) from error
    included = [str(name) for name in xacro.all_includes[before:]]
    lacking = incomplete(document.documentElement, file, included)
    if lacking:
        raise file_error(str(file), None, "", None, lacking)
    return str(document.toprettyxml(indent="  ")), [Path(name).absolute() for name in included]


def arguments_of(file: Path, arguments: Sequence[str]) -> dict[str, str]:
    """Parse ``name:=value`` words.

    Raises:
        DescriptionError: An argument does not have the form ``name:=value``.
    """
    found = {}
    for word in arguments:
        match = ARGUMENT.fullmatch(word)
        if match is None:
            raise file_error(str(file), None, "xacro argument", word, "name:=value")
        found[match[1]] = match[2]
    return found


def _refused(file: Path, reason: str, stack: Sequence[str | None] | None) -> DescriptionError:
    """Return the error with the file and the line where the expansion stopped."""
    inner = next((name for name in reversed(stack or []) if name), str(file))
    line = re.search(r"line (\d+)", reason)
    within = "" if inner == str(file) else f", included by {file}"
    hint = missing(reason, Path(inner))
    reason = TWICE.sub(r"\1", " ".join(CLASS.sub("", reason[:MAX_REASON]).split()))
    # Surrogate characters cannot be printed.
    reason = reason.encode(errors="replace").decode()
    expected = f"xacro that can be expanded ({reason}{within}{hint})"
    return file_error(inner, int(line[1]) if line else None, "", None, expected)


@contextmanager
def _packages_found(substitution_args: Any, packages: "_Packages") -> Iterator[None]:
    """Let xacro find packages in the folders near a file."""
    of_ros = substitution_args._eval_find

    def found(name: str) -> str:
        folder = packages.folder(name)
        if folder is None:
            try:
                folder = Path(of_ros(name))
            except Exception as error:
                # ROS is missing, or another package has replaced its package finder.
                raise substitution_args.SubstitutionException(packages.missed(name)) from error
        packages.readable.append(folder)
        return str(folder)

    functions = {**substitution_args._eval_dict, "find": found}
    with replaced(substitution_args, _eval_find=found, _eval_dict=functions):
        yield


class _Packages:
    """Finds packages in the folders above a file, and opens included files."""

    def __init__(self, file: Path) -> None:
        self.file = file
        self.above = list(file.parents)[:FOLDERS_UP]
        self.readable = [input_folder(file)]

    def opened(self, name: str) -> io.BytesIO:
        """Open a file that another file includes.

        Replaces ``open`` in xacro.
        """
        return io.BytesIO(included_bytes(Path(name), self.readable, self.file))

    def folder(self, name: str) -> Path | None:
        """Return the folder of a package, or None."""
        stem = _stem(name)
        rules = ((self._declared, name), (self._named, name), (self._named_nearly, stem))
        for known, sought in rules:
            for folder in self.above:
                if sought in (there := known(folder)):
                    return there[sought]
        return None

    def missed(self, name: str) -> str:
        """Return an error text with the searched folders."""
        return (
            f"no package {name!r} in {self.above[0]} and {FOLDERS_UP - 1} folders above it, nor in "
            f"ROS: put the package there, as a folder {name}"
        )

    def _declared(self, folder: Path) -> Mapping[str, Path]:
        files = [folder / PACKAGE_FILE, *files_like(folder, f"*/{PACKAGE_FILE}")]
        return {_package_name(file): file.parent for file in files if file.is_file()}

    def _named(self, folder: Path) -> Mapping[str, Path]:
        inner = (path for path in files_like(folder, "*") if path.is_dir())
        return {folder.name: folder} | {path.name: path for path in inner}

    def _named_nearly(self, folder: Path) -> Mapping[str, Path]:
        return {_stem(name): path for name, path in self._named(folder).items()}


def _stem(name: str) -> str:
    return next((name.removesuffix(end) for end in PACKAGE_ENDINGS if name.endswith(end)), name)


def _package_name(file: Path) -> str:
    document = nearby_document(file)
    names = document.getElementsByTagName("name") if document else []
    text = names[0].firstChild if names else None
    return str(text.nodeValue).strip() if text else file.parent.name
