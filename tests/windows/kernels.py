"""Compiles the kernels of all shipped robots for Windows, with the compiler in CC.

A kernel depends on the platform by its name and by the compiler's target only.
"""

import platform
import sys
from pathlib import Path

import chasles
from chasles.cli.portable import write_portable
from chasles.contract import read_manifest
from chasles.library import find_folder


def main(folder: Path) -> None:
    platform.system = lambda: "Windows"
    platform.machine = lambda: "AMD64"
    for name in chasles.robots():
        print(write_portable(read_manifest(find_folder(name)), folder), flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
