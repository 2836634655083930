"""The structure of the project: short files, unique test files, imports in one direction."""

import ast
import re
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import fields
from functools import cache, cached_property
from graphlib import CycleError, TopologicalSorter
from importlib import import_module
from pathlib import Path

import pytest

TESTS = Path(__file__).resolve().parent
ROOT = TESTS.parent
DERIVE, CONTRACT, RUNTIME, APPS = (
    ROOT / name for name in ("derive", "contract", "runtime", "apps")
)
BENCH = ROOT / "bench"
HALVES = {"derive": DERIVE, "contract": CONTRACT, "runtime": RUNTIME, "apps": APPS}
WRITTEN = {**HALVES, "tests": TESTS, "bench": BENCH}
"""Folders of handwritten files. The compiler writes generated/."""

MAX_LINES = 500
MAX_LINES_OF_RUNTIME = 15_000
MAX_LINES_OF_EXPORTER = 600
"""Maximum number of handwritten lines in each exporter folder of `derive/emit`."""
SUFFIXES = {".py", ".c", ".cpp", ".h"}
BUILT = {".so", ".pyc", ".o"}
SHARED = {"support", "campaigns", "laws"}
"""Folders of tests whose modules other tests may import."""

STAGES = (
    ("model",),
    ("terms",),
    ("chain", "description"),
    ("loops",),
    ("quality",),
    ("inverse",),
    ("derivation",),
    ("checking", "sympy_expressions"),
    ("program",),
    ("latex",),
    ("conversion",),
    ("emit",),
    ("build",),
    ("__init__",),
)
"""Packages and modules of the compiler, in import order.

A package imports only from itself and from packages before it in the list.
"""
RANK = {room: rank for rank, rooms in enumerate(STAGES) for room in rooms}
LOOP_STAGES = (
    *("model", "closing", "planar", "spatial", "solve"),
    *("functions", "modes", "iterated", "parametric", "checks"),
)
"""Folders of derive/loops, in import order.

A folder imports only from itself and from folders before it in the list.
"""
PLAN = (
    *("loops.closing", "loops.solve", "inverse.arms", "loops.functions", "loops.modes"),
    *("loops.iterated", "loops.parametric", "inverse"),
)
"""Folders of the steps that derive a mechanism, in order."""
FORWARDS = {"__init__", "__main__"}
"""Modules of the runtime that forward calls to apps."""
APP_NAMES = {
    *("autodiff", "calibration", "cli", "cuda", "drawing", "study", "summaries", "view"),
}
PUBLIC = {
    *("arrays", "contract", "contract.isolation", "fixed", "sampling", "screws", "se3"),
    "tolerances",
}
"""Modules of `chasles` that apps may import. The command line also starts compilers."""
COMMAND_LINE_ONLY = {"derive", "derive.build", "library"}


def handwritten(root: Path) -> list[Path]:
    """Return the files of a folder that are not generated."""
    files = (path for path in root.rglob("*") if path.is_file() and path.suffix not in BUILT)
    return sorted(path for path in files if "__pycache__" not in path.parts)


def modules(root: Path) -> dict[tuple[str, ...], Path]:
    """Return the Python files below a folder, keyed by their dotted module names.

    The key of the file `__init__.py` in `root` is the empty tuple.
    """
    found = {}
    for path in root.rglob("*.py"):
        parts = path.relative_to(root).with_suffix("").parts
        found[parts[:-1] if parts[-1] == "__init__" else parts] = path
    return found


def statements(body: list) -> Iterator[ast.AST]:
    """Yield all nested statements."""
    for node in body:
        yield node
        for part in ("body", "orelse", "finalbody", "handlers", "cases"):
            yield from statements(getattr(node, part, []))


@cache
def imports(path: Path) -> list[tuple[int, str, list[str]]]:
    """Return (level, module, names) of every import of a file."""
    found = []
    for node in statements(ast.parse(path.read_text(encoding="utf-8")).body):
        if isinstance(node, ast.Import):
            found += [(0, alias.name, []) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            found.append((node.level, node.module or "", [alias.name for alias in node.names]))
    return found


@cache
def imported_modules(root: Path) -> dict[tuple[str, ...], set[tuple[str, ...]]]:
    """Map each module in the folder `root` to the modules of `root` that it imports.

    The file `root/__init__.py` is omitted, because `root/__init__.py` imports names of all packages
    lazily.
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
    """Return the nodes of a cycle in a graph, or an empty list."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return error.args[1]
    return []


def repeated(names: Iterator[str]) -> list[str]:
    return sorted(name for name, count in Counter(names).items() if count > 1)


def line_count(path: Path) -> int:
    return len(path.read_text(encoding="utf-8").splitlines())


@pytest.mark.parametrize("part", WRITTEN)
def test_files_are_short(part):
    files = [path for path in handwritten(WRITTEN[part]) if path.suffix in SUFFIXES]
    lines = {path: line_count(path) for path in files}
    assert len(files) >= 5
    assert {str(path): n for path, n in lines.items() if n > MAX_LINES} == {}


def test_runtime_is_small():
    files = [path for path in handwritten(RUNTIME) if path.suffix in SUFFIXES]
    lines = sum(map(line_count, files))
    assert 10_000 < lines <= MAX_LINES_OF_RUNTIME


def test_exporters_are_short():
    folders = [path for path in (DERIVE / "emit").iterdir() if (path / "support").is_dir()]
    lengths = {folder.name: sum(map(line_count, handwritten(folder))) for folder in folders}
    assert {"c", "c_float", "cpp", "cuda", "jax", "mex", "moveit", "rust"} <= lengths.keys()
    del lengths["c"]
    assert {name: n for name, n in lengths.items() if n > MAX_LINES_OF_EXPORTER} == {}


def test_test_file_names_are_unique():
    """Pytest imports test files from folders without __init__ by their bare names."""
    names = [path.stem for path in TESTS.rglob("test_*.py")]
    assert len(names) > 90
    assert repeated(names) == []


def room(name: tuple[str, ...]) -> str:
    return name[0] if name else "__init__"


def test_compiler_stages_import_only_earlier_stages():
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


def test_loop_folders_import_only_earlier_folders():
    graph = {name: of for name, of in imported_modules(DERIVE).items() if name[0] == "loops"}
    assert {name[1] for name in graph if len(name) > 1} == set(LOOP_STAGES)
    upwards = [
        f"{'.'.join(name)} imports {'.'.join(target)}"
        for name, targets in graph.items()
        for target in targets
        if target[0] == "loops" and LOOP_STAGES.index(target[1]) > LOOP_STAGES.index(name[1])
    ]
    assert upwards == []


def test_steps_of_a_mechanism_follow_the_plan():
    """`derivation.py` calls the functions of the folders in `PLAN` in the order of this list."""
    tree = ast.parse((DERIVE / "derivation.py").read_text(encoding="utf-8"))
    imported = [node for node in tree.body if isinstance(node, ast.ImportFrom) and node.level]
    folder_of = {
        alias.name: folder
        for node in imported
        for alias in node.names
        for folder in reversed(PLAN)
        if f"{node.module}.{alias.name}".startswith(f"{folder}.")
    }
    entered = dict.fromkeys(folder_of[name] for name in names_read(tree) if name in folder_of)
    assert [*entered] == [*PLAN]


def names_read(tree: ast.Module) -> Iterator[str]:
    """Yield the names of variables and attributes in the code that derives a mechanism."""
    steps = [part for node in tree.body for part in (node, *getattr(node, "body", ()))]
    step_of = {step.name: step for step in steps if isinstance(step, ast.FunctionDef)}

    def read(step: ast.FunctionDef) -> Iterator[str]:
        nodes = [node for part in step.body for node in ast.walk(part)]
        named = [node for node in nodes if isinstance(node, ast.Name | ast.Attribute)]
        # Sort the names by their position in the source.
        named.sort(key=lambda node: (node.lineno, node.end_lineno, node.end_col_offset))
        for node in named:
            name = node.id if isinstance(node, ast.Name) else node.attr
            inner = step_of.get(name)
            yield from (name,) if inner is None or inner is step else read(inner)

    yield from read(step_of["_of_mechanism"])


def test_ends_of_loop_joints_are_placed_by_the_loop_model_and_the_scene_only():
    """Only the loop model and the scene compute the position of a pin."""
    placing = {"placement_matrix", "matrix", "onward", "at_values", "_on", "_rotation"}
    found = set()
    for path in DERIVE.rglob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        for call in (node for node in ast.walk(tree) if isinstance(node, ast.Call)):
            name = getattr(call.func, "attr", getattr(call.func, "id", ""))
            parts = [getattr(part, "attr", "") for part in call.args]
            if name in placing and "placement" in parts:
                found.add(str(path.relative_to(DERIVE)))
    known = ("description/", "loops/model/")
    assert {name for name in found if not name.startswith(known)} == {"chain/rigid_bodies.py"}
    assert len(found) > 3


def test_results_of_steps_are_fields():
    """If a result were computed at its first use, the order of the steps would be hidden."""
    model, solved = (
        getattr(import_module(f"chasles.derive.loops.{path}"), name)
        for path, name in (
            ("closing.loop_model", "LoopModel"),
            ("solve.solved_loops", "SolvedLoops"),
        )
    )
    assert issubclass(solved, model)
    for record in (model, solved):
        assert record.__dataclass_params__.frozen
        assert not any(isinstance(part, cached_property) for part in vars(record).values())
    assert {field.name for field in fields(solved)} > {field.name for field in fields(model)}


@pytest.mark.parametrize("half", HALVES)
def test_modules_have_no_import_cycle(half):
    assert circle(imported_modules(HALVES[half])) == []


@pytest.mark.parametrize("half", HALVES)
def test_packages_have_no_import_cycle(half):
    rooms: dict[str, set[str]] = {}
    for name, targets in imported_modules(HALVES[half]).items():
        others = {room(target) for target in targets} - {room(name)}
        rooms.setdefault(room(name), set()).update(others)
    assert len(rooms) > 3
    assert circle(rooms) == []


INSTALLED_AS = {"derive": ("derive",), "contract": ("contract",), "runtime": (), "apps": ()}
"""Path of the subpackage of `chasles` into which each source folder is installed. An empty path
means that the folder's packages are directly in `chasles`."""


def imports_of_chasles(half: str) -> Iterator[tuple[Path, str, str, list[str]]]:
    """Yield (file, package, module below chasles, names) of each import from chasles."""
    for name, path in modules(HALVES[half]).items():
        package = (*INSTALLED_AS[half], *(name if path.stem == "__init__" else name[:-1]))
        for level, module, names in imports(path):
            parts = tuple(filter(None, module.split(".")))
            if level:
                parts = (*package[: len(package) - level + 1], *parts)
            elif parts[0] == "chasles":
                parts = parts[1:]
            else:
                continue
            yield path, room(name), ".".join(parts), names


def parts_of_chasles(module: str, names: list[str]) -> set[str]:
    """Return the names that an import statement takes from `chasles`: a top-level module, or the
    imported names."""
    return {module.split(".", maxsplit=1)[0]} if module else set(names)


def test_contract_depends_on_nothing():
    for path in modules(CONTRACT).values():
        for level, module, _ in imports(path):
            top = module.split(".")[0]
            assert level == 1 or (level == 0 and top in sys.stdlib_module_names), path


def test_runtime_imports_numpy_and_the_contract_alone():
    allowed = {"numpy", "chasles", *sys.stdlib_module_names}
    reached = Counter()
    for name, path in modules(RUNTIME).items():
        package = name if path.stem == "__init__" else name[:-1]
        for level, module, _ in imports(path):
            assert level <= len(package) + 1, f"{path} reaches out of the runtime"
            assert level or module.split(".")[0] in allowed, f"{path} imports {module}"
            reached[room(name)] += 1
    assert len(reached) > 5
    for path, at, module, names in imports_of_chasles("runtime"):
        apart = parts_of_chasles(module, names) & (APP_NAMES | {"derive"})
        assert at in FORWARDS or not apart, f"{path} imports {apart}"


def test_compiler_imports_only_the_contract():
    for path, _, module, names in imports_of_chasles("derive"):
        parts = parts_of_chasles(module, names)
        assert parts <= {"contract", "derive"}, f"{path} imports {parts}"


def test_apps_import_only_public_names():
    found = 0
    for path, app, module, names in imports_of_chasles("apps"):
        if module.split(".")[0] in APP_NAMES:
            continue
        found += 1
        allowed = PUBLIC | (COMMAND_LINE_ONLY if app == "cli" else set())
        assert module in {"", *allowed}, f"{path} imports {module}"
        imported = import_module(f"chasles.{module}".rstrip("."))
        offered = {
            *getattr(imported, "__all__", names),
            *(() if module else {"__version__", *allowed, *APP_NAMES}),
        }
        assert set(names) <= offered, f"{path} imports {set(names) - offered}"
    assert found > 80


def test_apps_use_no_private_attribute_of_a_robot():
    for path in python_files("apps"):
        private = re.findall(r"\b(?:robot|arm)\._[a-z]\w*", path.read_text(encoding="utf-8"))
        assert private == [], path


def absolute_imports(path: Path, root: Path) -> Iterator[tuple[str, ...]]:
    """Yield the dotted names that a file imports.

    Relative imports become names relative to ``root``.
    """
    package = path.relative_to(root).parent.parts
    for level, module, names in imports(path):
        base = (*(package[: len(package) - level + 1] if level else ()), *filter(None, [module]))
        dotted = tuple(".".join(base).split("."))
        yield from ((*dotted, name) for name in names or [""])


def python_files(*folders: str) -> list[Path]:
    return [path for folder in folders for path in sorted((ROOT / folder).rglob("*.py"))]


def test_only_bench_imports_bench():
    files = python_files(*HALVES, "tests", "docs")
    assert len(files) > 300
    for path in files:
        for name in absolute_imports(path, ROOT):
            assert name[0] != "bench", f"{path} imports {'.'.join(name)}"


def test_tests_are_imported_by_tests_and_their_support_by_bench():
    found = 0
    for path in python_files(*HALVES, "bench"):
        for name in absolute_imports(path, ROOT):
            if name[0] == "tests":
                assert path.is_relative_to(BENCH), f"{path} imports {'.'.join(name)}"
                assert name[1] in SHARED, f"{path} imports {'.'.join(name)}"
                found += 1
    assert found > 10


def test_tests_import_no_other_test_file():
    found = 0
    for path in python_files("tests"):
        for name in absolute_imports(path, ROOT):
            if name[0] == "tests":
                assert name[1] in SHARED, f"{path} imports {'.'.join(name)}"
                assert not any(part.startswith("test_") for part in name[:-1]), path
                found += 1
    assert found > 300
