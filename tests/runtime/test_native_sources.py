"""Rules for the C sources of the runtime: all tolerances in one file, one subject per file."""

import re
from pathlib import Path

import chasles

RUNTIME = Path(chasles.__file__).parent
SOURCES = sorted([*RUNTIME.glob("**/*.c"), *RUNTIME.glob("**/*.h")])
TOLERANCES = RUNTIME / "numerics" / "_tolerances.h"
COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
SMALL = re.compile(r"(?<![\w.])(?:\d+\.?\d*[eE]-\d+|0\.0*[1-9]\d*|DBL_EPSILON)(?!\w)")
"""Pattern for small constants: numbers with a negative exponent, decimal fractions below 1, and
machine epsilon."""
HALF = "0.5"
LONGEST = 500


def code(path):
    return COMMENT.sub("", path.read_text())


def test_tolerances_are_defined_in_single_file():
    others = [path for path in SOURCES if path != TOLERANCES]
    found = {path.name: set(SMALL.findall(code(path))) - {HALF} for path in others}
    assert len(found) > 30
    assert not {name: numbers for name, numbers in found.items() if numbers}


def test_every_tolerance_is_documented_and_used():
    text = TOLERANCES.read_text()
    names = re.findall(r"^#define (\w+) \S", text, re.MULTILINE)
    assert len(names) > 30
    for paragraph in re.split(r"\n\n", text):
        if re.search(r"^#define \w+ \S", paragraph, re.MULTILINE):
            assert paragraph.startswith("/*"), paragraph
    used = "".join(code(path) for path in SOURCES if path != TOLERANCES)
    assert [name for name in names if not re.search(rf"\b{name}\b", used)] == []


def test_native_files_are_short_and_uniquely_named():
    assert {path.name for path in SOURCES if len(path.read_text().splitlines()) > LONGEST} == set()
    assert len({path.name for path in SOURCES}) == len(SOURCES)
