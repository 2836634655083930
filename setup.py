"""Build steps that pyproject.toml cannot describe: C extensions and robot packages."""

import os
import sys
from pathlib import Path

import numpy as np
from setuptools import Extension, find_packages, setup

_DAMPED = "velocity/native/damped_box.c"
EXTENSIONS = {
    "call._call": ["call/_call.c", "call/*/*.c"],
    "closed_form._filters": ["closed_form/_filters.c"],
    "iterative._numeric": ["iterative/_numeric.c", "iterative/native/*.c"],
    "velocity._rates": [
        "velocity/_rates.c",
        "velocity/native/*_loop.c",
        "velocity/native/bounded_rates.c",
        "numerics/_svd.c",
        _DAMPED,
    ],
    "velocity._track": ["velocity/_track.c", "velocity/native/path_tracking.c", _DAMPED],
}
"""Modules written in C, each with its source files under runtime/."""


WINDOWS = os.name == "nt" or "-windows-" in os.environ.get("CC", "")
"""Whether this machine or the target of the compiler is Windows."""
if WINDOWS:
    # The C code uses vectors and attributes that only GCC and clang have. Zig contains clang, and
    # pip installs it. With the option -target, Zig uses only instructions that all processors of
    # the target have.
    python = Path(sys.executable).as_posix()
    os.environ.setdefault("CC", f'"{python}" -m ziglang cc -target x86_64-windows-gnu')
    Path("build").mkdir(exist_ok=True)

APPS = ("autodiff", "calibration", "cli", "cuda", "drawing", "study", "summaries", "view")


def packages_under(folder):
    """Return the installed names of the packages in a folder."""
    prefix = f"chasles.{Path(folder).name}"
    return [prefix, *(f"{prefix}.{name}" for name in find_packages(folder))]


def extension(name, patterns):
    """Return the build settings of a module written in C."""
    runtime = Path("runtime")
    return Extension(
        f"chasles.{name}",
        sorted(str(path) for pattern in patterns for path in runtime.glob(pattern)),
        depends=sorted(map(str, [*runtime.glob("**/*.h"), *Path("contract").glob("*.h")])),
        include_dirs=["runtime", "contract", np.get_include()],
        # Some builds of Python compile extensions with -O2. No code reads errno, so square roots
        # need not set it. With hidden symbols, calls between files need no procedure linkage table.
        extra_compile_args=["-O3", "-fno-math-errno", "-fno-trapping-math", "-fvisibility=hidden"],
        # Zig also writes import libraries, which do not belong in a wheel.
        extra_link_args=["-Wl,--out-implib,build/unused.lib"] if WINDOWS else [],
        define_macros=[
            ("NPY_NO_DEPRECATED_API", "NPY_2_0_API_VERSION"),
            ("NPY_TARGET_VERSION", "NPY_2_0_API_VERSION"),
            # The headers of Python define this macro for the compiler of Microsoft only.
            *([("MS_WIN64", "")] if WINDOWS else []),
        ],
    )


setup(
    packages=[
        "chasles",
        *(f"chasles.{name}" for name in find_packages("runtime")),
        "chasles.contract",
        *(name for app in APPS for name in packages_under(f"apps/{app}")),
        *packages_under("derive"),
        *packages_under("generated"),
    ],
    package_data={
        "chasles": ["py.typed", "*.pyi", "*/*.pyi", "call/hints.toml", "library/_kernel.h"],
        "chasles.contract": ["*.h"],
        "chasles.autodiff": ["*.cpp"],
        "chasles.view": ["page/*", "three/*"],
        "chasles.derive": [
            "py.typed",
            "robots/*",
            "robots/shelf/*",
            "description/templates/*.toml",
            "emit/*/support/*",
            "emit/*/support/*/*",
        ],
        **{
            name: [
                "*.c",
                "*.h",
                "*.json",
                "*.pyi",
                "*.tex",
                "*/*.tex",
                "*.casadi",
                "*.so",
                "support/*.h",
            ]
            for name in packages_under("generated")
        },
    },
    ext_modules=[extension(*item) for item in EXTENSIONS.items()],
    options={"build_ext": {"compiler": "mingw32"}} if WINDOWS else {},
)
