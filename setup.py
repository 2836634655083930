"""What pyproject.toml cannot say: the C extensions, and one package for each generated robot."""

import numpy as np
from setuptools import Extension, find_packages, setup


def packages_under(folder):
    """The packages of a folder, under the names they have once installed."""
    prefix = f"chasles.{folder}"
    return [prefix, *(f"{prefix}.{name}" for name in find_packages(folder))]


def extension(name):
    """One of the modules in C."""
    return Extension(
        f"chasles.{name}",
        [f"runtime/{name}.c"],
        depends=["runtime/_kernel.h"],
        include_dirs=[np.get_include()],
        define_macros=[
            ("NPY_NO_DEPRECATED_API", "NPY_2_0_API_VERSION"),
            ("NPY_TARGET_VERSION", "NPY_2_0_API_VERSION"),
        ],
    )


setup(
    packages=["chasles", *packages_under("derive"), *packages_under("generated")],
    package_data={
        "chasles": ["py.typed", "_call.pyi", "_rates.pyi", "_kernel.h"],
        "chasles.derive": ["py.typed", "robots/*", "c/*"],
        **{
            name: ["*.c", "*.h", "*.json", "*.pyi", "*.tex", "*/*.tex", "*.casadi"]
            for name in packages_under("generated")
        },
    },
    ext_modules=[extension("_call"), extension("_rates")],
)
