"""External programs for tests, such as pdflatex.

Tests that need a missing program are skipped.
"""

import shutil

import pytest

PACKAGES = {
    "arm-none-eabi-gcc": "gcc-arm-none-eabi libnewlib-arm-none-eabi",
    "cc": "gcc",
    "chromium": "chromium",
    "clang": "clang",
    "cmake": "cmake",
    "g++": "g++",
    "gcc": "gcc",
    "nm": "binutils",
    "octave-cli": "octave octave-dev",
    "pkg-config": "pkg-config libeigen3-dev",
    "pdflatex": "texlive-latex-base texlive-latex-recommended texlive-latex-extra lmodern",
    "qemu-system-arm": "qemu-system-arm",
    "tcc": "tcc",
    "valgrind": "valgrind",
}
"""Debian packages that contain each program."""
MISSING = "missing program"
"""Prefix of the skip reason for a missing program."""


def reason(program: str) -> str:
    """Return the message that a test is skipped because a program is missing."""
    return f"{MISSING}: {program} (apt-get install {PACKAGES[program]})"


def needs(program: str) -> pytest.MarkDecorator:
    """Return the pytest mark that skips a test if a program is missing."""
    return pytest.mark.skipif(shutil.which(program) is None, reason=reason(program))


def path_of(program: str) -> str:
    """Return the path of a program, or skip the test if the program is missing."""
    path = shutil.which(program)
    if path is None:
        pytest.skip(reason(program))
    return path
