"""What pyproject.toml cannot say: the C extension, and one package for each generated robot."""

import numpy as np
from setuptools import Extension, find_packages, setup


def packages_under(folder):
    """The packages of a folder, under the names they have once installed."""
    prefix = f"chasles.{folder}"
    return [prefix, *(f"{prefix}.{name}" for name in find_packages(folder))]


setup(
    packages=["chasles", *packages_under("derive"), *packages_under("generated")],
    package_data={
        "chasles": ["py.typed", "_call.pyi", "_kernel.h", "_track.pyi"],
        "chasles.derive": ["py.typed", "robots/*", "c/*"],
        **{
            name: ["*.c", "*.h", "*.json", "*.pyi", "*.tex", "*/*.tex", "*.casadi"]
            for name in packages_under("generated")
        },
    },
    ext_modules=[
        Extension(
            "chasles._call",
            ["runtime/_call.c"],
            depends=["runtime/_kernel.h"],
            include_dirs=[np.get_include()],
            define_macros=[
                ("NPY_NO_DEPRECATED_API", "NPY_2_0_API_VERSION"),
                ("NPY_TARGET_VERSION", "NPY_2_0_API_VERSION"),
            ],
        ),
        Extension(
            "chasles._track",
            ["runtime/_track.c"],
            depends=["runtime/_damped.h", "runtime/_kernel.h"],
            extra_compile_args=["-O3", "-fno-math-errno", "-fno-trapping-math"],
        ),
    ],
)
