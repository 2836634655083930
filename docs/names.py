"""``python docs/names.py`` writes docs/reference/names.md, the page of all public names."""

import inspect
import textwrap
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType

from chasles.call.capabilities import Hint

PAGE = Path(__file__).parent / "reference" / "names.md"
MODULES = (
    "chasles",
    "chasles.se3",
    "chasles.so3",
    "chasles.study",
    "chasles.study.motion",
    "chasles.study.planning",
    "chasles.calibration",
    "chasles.autodiff",
    "chasles.cuda",
    "chasles.drawing",
    "chasles.view",
    "chasles.derive",
)
HEAD = """\
# Public names

The names below are the public interface of chasles; all other names may change without notice.
A robot also has the functions that `robot.functions` lists. `python docs/names.py` writes this
page, and a test compares it with the package.
"""
WIDTH = 118


def names_of(module: ModuleType) -> list[str]:
    """Return the public names of a module: its ``__all__``, otherwise the names it defines."""
    if hasattr(module, "__all__"):
        return sorted(module.__all__)
    defined = vars(module).items()
    own = [name for name, value in defined if getattr(value, "__module__", "") == module.__name__]
    return sorted(name for name in own if not name.startswith("_"))


def members_of(kind: type) -> list[str]:
    """Return the public attributes of a chasles class, including inherited attributes.

    Names that exist only for the hint in their error message, such as `fkine`, are omitted.
    """
    own = [base for base in kind.__mro__ if base.__module__.startswith("chasles")]
    found = {name for base in own for name in (*vars(base), *vars(base).get("__annotations__", {}))}
    hints = {name for base in own for name, v in vars(base).items() if isinstance(v, Hint)}
    return sorted(name for name in found - hints if not name.startswith("_"))


def _lines(module: ModuleType) -> Iterator[str]:
    values = {name: getattr(module, name) for name in names_of(module)}
    classes = {name: value for name, value in values.items() if inspect.isclass(value)}
    plain = [name for name in values if name not in classes or not members_of(classes[name])]
    yield f"\n## {module.__name__}\n"
    if plain:
        yield from textwrap.wrap(f"The module `{module.__name__}` has {_listed(plain)}.", WIDTH)
    for name, kind in classes.items():
        if members := members_of(kind):
            yield from ("", *textwrap.wrap(f"The class **{name}** has {_listed(members)}.", WIDTH))


def _listed(names: list[str]) -> str:
    first, last = ", ".join(f"`{name}`" for name in names[:-1]), f"`{names[-1]}`"
    return f"{first} and {last}" if first else last


def page() -> str:
    """Return the text of the page."""
    lines = [line for name in MODULES for line in _lines(import_module(name))]
    return "\n".join([HEAD.rstrip(), *lines, ""])


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
