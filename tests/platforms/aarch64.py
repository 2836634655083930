"""Builds the wheel for Linux on aarch64, and compares its values under QEMU with this machine.

The root is a folder with unpacked packages of Debian for arm64: libpython3.11-dev, libpython3.11,
python3.11-minimal and their dependencies. The tools folder contains setuptools and NumPy for
aarch64. The emulator qemu-aarch64 runs the Python interpreter in the root folder. The Zig compiler
runs on the host.

The results are in build/aarch64.
"""

import argparse
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
BUILD = ROOT / "build/aarch64"
KERNELS, SOURCE, SITE, VALUES, COMPILER = (
    BUILD / name for name in ("kernels", "source", "python", "values.npz", "cc")
)


def run(*command, folder=ROOT, **variables):
    """Run a command with additional environment variables.

    Raise an error if the command fails.
    """
    env = {**os.environ, **variables}
    subprocess.run(list(map(str, command)), cwd=folder, env=env, check=True)


def build_wheel(emulated, root, tools):
    """Build a wheel from the committed files and the compiled kernels."""
    shutil.rmtree(SOURCE, ignore_errors=True)
    SOURCE.mkdir(parents=True)
    archive = subprocess.run(
        ["git", "archive", "HEAD"], cwd=ROOT, stdout=subprocess.PIPE, check=True
    ).stdout
    subprocess.run(["tar", "-x"], cwd=SOURCE, input=archive, check=True)
    for kernel in KERNELS.glob("*/*.so"):
        shutil.copy(kernel, SOURCE / "generated" / kernel.parent.name)
    headers = (root / "usr/include/python3.11", root / "usr/include")
    run(
        *(*emulated, "setup.py", "-q", "bdist_wheel"),
        folder=SOURCE,
        PYTHONPATH=str(tools),
        CC=str(COMPILER),
        LDSHARED=f"{COMPILER} -shared",
        CFLAGS=" ".join(f"-I{folder}" for folder in (*headers, tools / "numpy/_core/include")),
    )
    (wheel,) = SOURCE.glob("dist/*.whl")
    return wheel


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--root", type=Path, required=True, help="folder with usr/bin/python3.11")
    parser.add_argument("--tools", type=Path, required=True, help="folder of setuptools and NumPy")
    options = parser.parse_args()
    if not shutil.which("qemu-aarch64"):
        sys.exit("qemu-aarch64 is missing (apt-get install qemu-user)")
    root, tools = options.root.resolve(), options.tools.resolve()
    zig = f"{sys.executable} -m ziglang cc -target aarch64-linux-gnu.2.28"
    BUILD.mkdir(parents=True, exist_ok=True)
    # PYTHONPATH is for the emulated Python only.
    COMPILER.write_text(f'#!/bin/sh\nunset PYTHONPATH\nexec {zig} "$@"\n')
    COMPILER.chmod(0o755)
    run(sys.executable, HERE / "kernels.py", KERNELS, "Linux", "aarch64", CC=COMPILER)
    emulated = (shutil.which("qemu-aarch64"), "-L", root, root / "usr/bin/python3.11")
    wheel = build_wheel(emulated, root, tools)
    shutil.rmtree(SITE, ignore_errors=True)
    shutil.copytree(tools / "numpy", SITE / "numpy")
    shutil.copytree(tools / "numpy.libs", SITE / "numpy.libs")
    zipfile.ZipFile(wheel).extractall(SITE)
    run(sys.executable, HERE / "values.py", "write", VALUES)
    compare = (HERE / "values.py", "compare", VALUES, KERNELS)
    # Without PATH, no compiler is found, so the robots must load the installed kernels.
    no_compiler = {"PATH": str(BUILD), "CC": "", "CHASLES_CACHE": str(BUILD / "cache")}
    run(*emulated, *compare, PYTHONPATH=str(SITE), **no_compiler)
    print(f"{wheel}: values under QEMU equal the values of this machine")


if __name__ == "__main__":
    main()
