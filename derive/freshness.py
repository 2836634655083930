"""Whether a robot's generated folder is up to date; answers without SymPy, in milliseconds.

A stamp in the folder, never committed, holds the hash of all that the files were made from and of
the files themselves.
"""

import hashlib
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

ROOM = Path(__file__).parent
STAMP = ".derived"


@dataclass(frozen=True)
class Job:
    """One robot to derive.

    Attributes:
        file: Its description.
        to: The folder that receives the robot's own folder.
        base: Base link of a URDF.
        tip: Tip link of a URDF.
        functions: The functions wanted, all where empty.
    """

    file: Path
    to: Path
    base: str | None = None
    tip: str | None = None
    functions: tuple[str, ...] = ()


def is_up_to_date(job: Job) -> bool:
    """Whether some folder of the job's target was made from just this and is unchanged."""
    recipe = _recipe(job)
    return any(
        stamp.read_text(encoding="ascii") == f"{recipe}\n{_contents(stamp.parent)}\n"
        for stamp in job.to.glob(f"*/{STAMP}")
    )


def stamp(job: Job, folder: Path) -> None:
    """Marks a folder as made from a job."""
    text = f"{_recipe(job)}\n{_contents(folder)}\n"
    (folder / STAMP).write_text(text, encoding="ascii")


def _recipe(job: Job) -> str:
    digest = hashlib.sha256()
    for path in (job.file, *sorted([*ROOM.rglob("*.py"), *ROOM.rglob("*.h")])):
        digest.update(path.read_bytes() + b"\0")
    choices = (job.base, job.tip, job.functions, version("casadi"), version("sympy"))
    digest.update(repr(choices).encode())
    return digest.hexdigest()


def _contents(folder: Path) -> str:
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*")):
        if path.is_file() and path.name != STAMP and "__pycache__" not in path.parts:
            digest.update(str(path.relative_to(folder)).encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()
