"""The structure of the project: small files, names used once, imports in one direction."""

import ast
from collections import Counter
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import chasles
import chasles.derive

DERIVE = Path(chasles.derive.__file__).resolve().parent
RUNTIME = Path(chasles.__file__).resolve().parent
TESTS = Path(__file__).resolve().parent
BENCH = TESTS.parent / "bench"
HALVES = {"derive": DERIVE, "runtime": RUNTIME}
WRITTEN = {**HALVES, "tests": TESTS, "bench": BENCH}
"""Folders of handwritten files; generated/ is written by the compiler."""

MOST_LINES = 500
MOST_FILES = 14
SUFFIXES = {".py", ".c", ".cpp", ".h"}
ONE_FILE_EACH = {DERIVE / "robots", DERIVE / "robots" / "shelf"}
"""Folders of data that hold one file for every robot and grow with their number."""
BUILT = {".so", ".pyc", ".o"}
UNNAMED = {"__init__", "__main__", "conftest"}
"""Modules whose names Python or pytest prescribes."""

STAGES = (
    ("beside",),
    ("model",),
    ("terms",),
    ("chain", "description"),
    ("loops",),
    ("quality",),
    ("inverse",),
    ("derivation",),
    ("program",),
    ("latex",),
    ("emit",),
    ("build",),
    ("cli",),
    ("__init__", "__main__"),
)
"""Rooms and modules of the compiler; each imports from earlier stages and from itself alone."""
RANK = {room: rank for rank, rooms in enumerate(STAGES) for room in rooms}
COMPILER_ONLY = {"sympy", "casadi", "mpmath", "lxml", "typer", "xacro", "mujoco", "yaml"}


def handwritten(root: Path) -> list[Path]:
    """Files of a folder that a person wrote."""
    files = (path for path in root.rglob("*") if path.is_file() and path.suffix not in BUILT)
    return sorted(path for path in files if "__pycache__" not in path.parts)


def modules(root: Path) -> dict[tuple[str, ...], Path]:
    """Python files of a half by their dotted names, relative to it; () is its own __init__."""
    found = {}
    for path in root.rglob("*.py"):
        parts = path.relative_to(root).with_suffix("").parts
        found[parts[:-1] if parts[-1] == "__init__" else parts] = path
    return found


def imports(path: Path) -> Iterator[tuple[int, str, list[str]]]:
    """Level, module and names of every import, those inside functions included."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((0, alias.name, []) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.level, node.module or "", [alias.name for alias in node.names]


def imported_modules(root: Path) -> dict[tuple[str, ...], set[tuple[str, ...]]]:
    """For each module of a half, the modules of the same half that it imports.

    The half's own __init__ is left out: it offers names of all rooms, and imports them when they
    are first used.
    """
    known = modules(root)
    found: dict[tuple[str, ...], set[tuple[str, ...]]] = {}
    for name, path in known.items():
        if not name:
            continue
        package = name if path.stem == "__init__" else name[:-1]
        found[name] = set()
        for level, module, names in imports(path):
            if level == 0:
                continue
            base = (*package[: len(package) - level + 1], *filter(None, module.split(".")))
            for item in names:
                target = (*base, item) if (*base, item) in known else base
                found[name] |= {target} - {(), name}
    return found


def circle(graph: dict) -> list:
    """The nodes of one circle of a graph, in order; empty where there is none."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return error.args[1]
    return []


def repeated(names: Iterator[str]) -> list[str]:
    return sorted(name for name, count in Counter(names).items() if count > 1)


@pytest.mark.parametrize("part", WRITTEN)
def test_files_are_short(part):
    files = [path for path in handwritten(WRITTEN[part]) if path.suffix in SUFFIXES]
    lines = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in files}
    assert len(files) > 30
    assert {str(path): n for path, n in lines.items() if n > MOST_LINES} == {}


@pytest.mark.parametrize("part", WRITTEN)
def test_folders_are_small(part):
    counts = Counter(path.parent for path in handwritten(WRITTEN[part]))
    assert len(counts) > 5
    large = {str(folder): n for folder, n in counts.items() if n > MOST_FILES}
    assert {f: n for f, n in large.items() if Path(f) not in ONE_FILE_EACH} == {}


@pytest.mark.parametrize("half", HALVES)
def test_a_module_has_a_name_of_its_own(half):
    names = [path.stem for path in modules(HALVES[half]).values()]
    assert len(names) > 30
    assert repeated(name for name in names if name not in UNNAMED) == []


def test_a_test_file_has_a_name_of_its_own():
    """Pytest imports test files of folders without __init__ by their bare names."""
    names = [path.stem for path in TESTS.rglob("*.py") if path.stem not in UNNAMED]
    assert len(names) > 90
    assert repeated(names) == []


@pytest.mark.parametrize("half", HALVES)
def test_a_public_class_has_a_name_of_its_own(half):
    names = [
        node.name
        for path in modules(HALVES[half]).values()
        for node in ast.parse(path.read_text(encoding="utf-8")).body
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_")
    ]
    assert len(names) > 10
    assert repeated(names) == []


def room(name: tuple[str, ...]) -> str:
    return name[0] if name else "__init__"


def test_stages_of_the_compiler_import_from_earlier_ones_alone():
    graph = imported_modules(DERIVE)
    assert {room(name) for name in graph} <= set(RANK)
    upwards = [
        f"{'.'.join(name)} imports {'.'.join(target)}"
        for name, targets in graph.items()
        for target in targets
        if room(name) != room(target) and RANK[room(target)] >= RANK[room(name)]
    ]
    assert sum(map(len, graph.values())) > 200
    assert sorted(upwards) == []


@pytest.mark.parametrize("half", HALVES)
def test_no_modules_import_each_other(half):
    assert circle(imported_modules(HALVES[half])) == []


@pytest.mark.parametrize("half", HALVES)
def test_no_rooms_import_each_other(half):
    rooms: dict[str, set[str]] = {}
    for name, targets in imported_modules(HALVES[half]).items():
        others = {room(target) for target in targets} - {room(name)}
        rooms.setdefault(room(name), set()).update(others)
    assert len(rooms) > 5
    assert circle(rooms) == []


def test_the_runtime_needs_nothing_of_the_compiler():
    reached = Counter()
    for name, path in modules(RUNTIME).items():
        package = name if path.stem == "__init__" else name[:-1]
        for level, module, _ in imports(path):
            top = module.split(".")[0]
            assert level <= len(package) + 1, f"{path} reaches out of the runtime"
            assert level or top not in COMPILER_ONLY, f"{path} imports {module}"
            assert top != "derive", f"{path} imports {module}"
            assert not module.startswith("chasles.derive"), f"{path} imports {module}"
            reached[room(name)] += 1
    assert len(reached) > 5
