"""Builds the wheel for Windows on Linux, and compares its values under Wine with Linux.

The folder of CPython for Windows contains the files of its embeddable package. NumPy is a wheel for
win_amd64; the complex functions of NumPy 2.2 and later do not run in Wine 8.

The results are in build/windows.
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
BUILD = ROOT / "build/windows"
KERNELS, SOURCE, SITE, VALUES = (
    BUILD / name for name in ("kernels", "source", "python", "values.npz")
)


def run(*command, folder=ROOT, **variables):
    """Run a command with additional environment variables.

    Raise an error if the command fails.
    """
    words = list(map(str, command))
    env = {**os.environ, **variables}
    subprocess.run(words, cwd=folder, env=env, stdin=subprocess.DEVNULL, check=True)


def run_in_wine(*command):
    """Run a command for Windows, and stop if it fails."""
    env = {**os.environ, "WINEPREFIX": str(BUILD / "prefix"), "WINEDEBUG": "-all"}
    env |= {"CC": "", "CHASLES_CFLAGS": "", "CHASLES_CACHE": ""}
    words = ["wine", *map(str, command)]
    # Under Wine, a Windows Python can write to a pipe, but not to a Linux terminal or a Linux file.
    pipes = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    with subprocess.Popen(words, env=env, text=True, errors="replace", **pipes) as process:
        for line in process.stdout:
            print(line, end="", flush=True)
    if process.returncode:
        sys.exit(f"{words} failed with status {process.returncode}")


def build_wheel(zig, version, python, headers, builder):
    """Build a wheel from the committed files and the compiled kernels."""
    shutil.rmtree(SOURCE, ignore_errors=True)
    SOURCE.mkdir(parents=True)
    archive = subprocess.run(
        ["git", "archive", "HEAD"], cwd=ROOT, stdout=subprocess.PIPE, check=True
    ).stdout
    subprocess.run(["tar", "-x"], cwd=SOURCE, input=archive, check=True)
    for kernel in KERNELS.glob("*/*.so"):
        shutil.copy(kernel, SOURCE / "generated" / kernel.parent.name)
    # The Python for Linux has a pyconfig.h for Linux. The macro Py_PYCONFIG_H skips this file.
    own = f"-I{headers} -DPy_PYCONFIG_H -include {HERE / 'pyconfig.h'}"
    python_library = ("--libraries", f"python{version}", "--library-dirs", python)
    run(
        *(builder, "setup.py", "-q", "build_ext", *python_library),
        *("bdist_wheel", "--plat-name", "win_amd64"),
        folder=SOURCE,
        CC=f"{zig} {own}",
        SETUPTOOLS_EXT_SUFFIX=f".cp{version}-win_amd64.pyd",
    )
    (wheel,) = SOURCE.glob("dist/*.whl")
    return wheel


def install(python, version, *wheels):
    """Unpack the wheels into the library folder of a copy of CPython for Windows."""
    shutil.rmtree(SITE, ignore_errors=True)
    shutil.copytree(python, SITE)
    # Wine 8 does not have the functions that _wmi.pyd calls. Without _wmi.pyd, Python calls other
    # functions, which Wine provides.
    (SITE / "_wmi.pyd").unlink(missing_ok=True)
    (SITE / f"python{version}._pth").write_text(f"python{version}.zip\n.\nLib\n")
    for wheel in wheels:
        zipfile.ZipFile(wheel).extractall(SITE / "Lib")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--python", type=Path, required=True, help="folder with python.exe")
    parser.add_argument("--numpy", type=Path, required=True, help="wheel for win_amd64")
    parser.add_argument("--builder", required=True, help="Python for Linux of the same version")
    options = parser.parse_args()
    if not shutil.which("wine"):
        sys.exit("wine is missing (apt-get install wine64)")
    python = options.python.resolve()
    (version,) = (path.stem[6:] for path in python.glob("python3[0-9]*.dll"))
    zig = f"{options.builder} -m ziglang cc -target x86_64-windows-gnu"
    BUILD.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(options.numpy) as archive:
        archive.extractall(BUILD / "numpy")
    run(sys.executable, HERE / "kernels.py", KERNELS, "Windows", "AMD64", CC=zig)
    headers = BUILD / "numpy/numpy/_core/include"
    wheel = build_wheel(zig, version, python, headers, options.builder)
    install(python, version, options.numpy, wheel)
    run(sys.executable, HERE / "values.py", "write", VALUES)
    run_in_wine(SITE / "python.exe", HERE / "values.py", "compare", VALUES, KERNELS)
    print(f"{wheel}: values under Wine equal the values of Linux")


if __name__ == "__main__":
    main()
