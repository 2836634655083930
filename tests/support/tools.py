"""Programs that some tests need, such as pdflatex; without one, its tests are skipped."""

import shutil

import pytest

PACKAGES = {
    "cc": "gcc",
    "chromium": "chromium",
    "clang": "clang",
    "g++": "g++",
    "gcc": "gcc",
    "nm": "binutils",
    "pdflatex": "texlive-latex-base texlive-latex-recommended texlive-latex-extra lmodern",
    "valgrind": "valgrind",
}
"""Debian's packages of each program."""
MISSING = "missing program"
"""Begins the reason of each test that is skipped because of a program."""


def reason(program: str) -> str:
    """The reason of a test that is skipped because a program is missing."""
    return f"{MISSING}: {program} (apt-get install {PACKAGES[program]})"


def needs(program: str) -> pytest.MarkDecorator:
    """Mark of a test, or of all tests of a file, that needs a program."""
    return pytest.mark.skipif(shutil.which(program) is None, reason=reason(program))


def path_of(program: str) -> str:
    """The path of a program; skips the test where it is missing."""
    path = shutil.which(program)
    if path is None:
        pytest.skip(reason(program))
    return path
