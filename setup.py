"""What pyproject.toml cannot say: the C extensions, and one package for each generated robot."""

from pathlib import Path

import numpy as np
from setuptools import Extension, find_packages, setup

EXTENSIONS = ("call._call", "iterative._numeric", "velocity._rates", "velocity._track")


def packages_under(folder):
    """The packages of a folder, under the names they have once installed."""
    prefix = f"chasles.{folder}"
    return [prefix, *(f"{prefix}.{name}" for name in find_packages(folder))]


def extension(name):
    """One of the modules in C."""
    return Extension(
        f"chasles.{name}",
        [f"runtime/{name.replace('.', '/')}.c"],
        depends=sorted(map(str, Path("runtime").glob("*/*.h"))),
        include_dirs=["runtime", np.get_include()],
        # Some Pythons were built with -O2, and errno of square roots is read by nobody.
        extra_compile_args=["-O3", "-fno-math-errno", "-fno-trapping-math"],
        define_macros=[
            ("NPY_NO_DEPRECATED_API", "NPY_2_0_API_VERSION"),
            ("NPY_TARGET_VERSION", "NPY_2_0_API_VERSION"),
        ],
    )


setup(
    packages=[
        "chasles",
        *(f"chasles.{name}" for name in find_packages("runtime")),
        *packages_under("derive"),
        *packages_under("generated"),
    ],
    package_data={
        "chasles": ["py.typed", "*/*.pyi", "contract/_kernel.h"],
        "chasles.derive": ["py.typed", "robots/*", "emit/c/support/*"],
        **{
            name: ["*.c", "*.h", "*.json", "*.pyi", "*.tex", "*/*.tex", "*.casadi"]
            for name in packages_under("generated")
        },
    },
    ext_modules=[extension(name) for name in EXTENSIONS],
)
