"""Finds robots of the package robot_descriptions by name."""

from difflib import get_close_matches
from importlib import import_module
from pathlib import Path

from chasles.contract.errors import NotInstalledError

from ...model.errors import DescriptionError, UnknownRobotError

NEEDED = "pip install 'chasles[files]'"
ENDINGS = ("", "_description", "_mj_description")
MAX_SHOWN = 5


def described(name: str) -> tuple[Path, tuple[str, ...]]:
    """Return the file of a robot in robot_descriptions.

    The file is downloaded with git at the first use.

    Args:
        name: Name of a description in the package, such as ``ur5e_description``. Without a suffix,
            a URDF or xacro file is preferred to an MJCF model.

    Returns:
        The file, and the arguments of a xacro file as ``name:=value``.

    Raises:
        NotInstalledError: The package is not installed.
        UnknownRobotError: The robot is unknown.
        DescriptionError: The download failed, or the package contains no description of the robot.
    """
    try:
        from git.exc import GitError  # noqa: PLC0415
        from robot_descriptions import DESCRIPTIONS  # noqa: PLC0415
    except ImportError as error:
        reason = f"robot_descriptions and git ({NEEDED})"
        raise NotInstalledError(f"robot:{name}: expected {reason}") from error
    known = next((name + end for end in ENDINGS if name + end in DESCRIPTIONS), None)
    if known is None:
        close = get_close_matches(name, DESCRIPTIONS, n=MAX_SHOWN, cutoff=0.4)
        near = f", such as {', '.join(close)}" if close else ""
        raise UnknownRobotError(f"robot:{name}: expected a name of robot_descriptions{near}")
    try:
        module = import_module(f"robot_descriptions.{known}")
    except (GitError, OSError, ImportError) as error:
        reason = str(error).strip().splitlines()[-1] if str(error).strip() else repr(error)
        raise DescriptionError(f"robot:{name}: cannot download {known} ({reason})") from error
    for attribute in ("URDF_PATH", "XACRO_PATH", "MJCF_PATH"):
        if hasattr(module, attribute):
            given = getattr(module, "XACRO_ARGS", {}) if attribute == "XACRO_PATH" else {}
            return _there(name, getattr(module, attribute)), tuple(
                f"{argument}:={value}" for argument, value in given.items()
            )
    raise DescriptionError(
        f"robot:{name}: expected a URDF, a xacro file or an MJCF model in {known}"
    )


def _there(name: str, path: str) -> Path:
    if not Path(path).is_file():
        raise DescriptionError(f"robot:{name}: expected a file {path}")
    return Path(path)
