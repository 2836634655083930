"""Compiles the kernels of all shipped robots for another platform, with the compiler in CC.

In the command `python kernels.py FOLDER SYSTEM MACHINE`, SYSTEM and MACHINE are the values of
`platform.system()` and `platform.machine()` on the other platform.

The platform determines only the file name of a kernel and the target of the compiler.
"""

import platform
import sys
from pathlib import Path

import chasles
from chasles.cli.portable import write_portable
from chasles.contract import read_manifest
from chasles.library import find_folder


def main(folder: Path, system: str, machine: str) -> None:
    platform.system = lambda: system
    platform.machine = lambda: machine
    for name in chasles.robots():
        print(write_portable(read_manifest(find_folder(name)), folder), flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), *sys.argv[2:])
