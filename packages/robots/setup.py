"""One package for each robot."""

from pathlib import Path

from setuptools import setup
from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.dist import Distribution

PACKAGE = "chasles_robots"


class PlatformDistribution(Distribution):
    """A distribution with compiled libraries."""

    def has_ext_modules(self):
        """Return True, because the distribution contains compiled libraries."""
        return True


class PlatformWheel(bdist_wheel):
    """A wheel with libraries that do not use the C API of Python."""

    def get_tag(self):
        """Return the tag of the wheel for any Python 3 on this platform."""
        return "py3", "none", super().get_tag()[2]


ROBOTS = [f"{PACKAGE}.{file.parent.name}" for file in Path(PACKAGE).glob("*/manifest.json")]

setup(
    packages=[PACKAGE, *sorted(ROBOTS)],
    package_data={name: ["*.c", "*.h", "*.json", "*.pyi", "*.so"] for name in ROBOTS},
    distclass=PlatformDistribution,
    cmdclass={"bdist_wheel": PlatformWheel},
)
