"""Mutates files of every kind that chasles reads, and reads the mutated files.

Each trial mutates the example files in `corpus`, meshes, saved motions and workspaces of a robot,
and manifests. A mutation changes bytes, words, lines, JSON values or arrays of a file. The function
that reads a file must return a value within the time limit, or raise a chasles error that names the
file. Some XML descriptions are read in a separate process, as in normal use.
"""

import json
import random
import traceback
import warnings
from collections.abc import Callable
from contextlib import chdir
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import chasles
from chasles.calibration import read_measurements
from chasles.contract import read_manifest
from chasles.derive import ChaslesError, DescriptionError, apply_calibration, check, read
from chasles.derive.build.time_limit import OutOfTime, at_most
from chasles.derive.description.importers.chains import opened
from chasles.derive.description.importers.kinematic_tree import KinematicTree
from chasles.derive.description.importers.srdf import group_ends
from chasles.derive.model.exact import NotExact
from chasles.study import Workspace, workspace
from chasles.study.motion import MotionSequence, Trajectory
from chasles.view.meshes import drawing
from tests.support.derivations import GENERATED
from tests.support.generators.mutated_data import mutated_archive, mutated_bytes, mutated_json_text
from tests.support.generators.mutated_texts import mutated
from tests.support.handwritten import tiny

from .campaign import Campaign, Outcome

CORPUS = Path(__file__).parent / "corpus"
SECONDS = 20.0
"""Time limit for reading one mutated file [s]."""
KEPT = Path(__file__).parents[2] / "build" / "readers"
"""Folder that keeps each file whose reading failed."""
BYTEWISE = 0.3
"""Fraction of files in which bytes are mutated instead of whole words, values or arrays."""
ARM = """<robot name="drawn"><link name="base"><visual><geometry><mesh filename="{}"/></geometry>
</visual></link></robot>"""
Mutation = Callable[[bytes, random.Random], bytes]


@dataclass(frozen=True)
class Reader:
    """A function that reads files, and valid test files for this function.

    Attributes:
        name: Name of the file-reading function in the printed table.
        files: Number of mutated files per trial.
        file: Name of the file that is read.
        corpus: Valid files.
        read: Reads a file.
        mutation: Function that changes words, values or arrays of a valid file at random.
    """

    name: str
    files: int
    file: str
    corpus: tuple[bytes, ...]
    read: Callable[[Path], object]
    mutation: Mutation


def trial(number: int) -> Outcome:
    dice = random.Random(number)
    counts: dict[str, int] = {}
    failures = []
    # The working directory is temporary, because MuJoCo writes a log into it.
    with TemporaryDirectory() as folder, chdir(folder), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for reader in readers():
            refused = 0
            for k in range(reader.files):
                path = Path(folder) / reader.file
                path.write_bytes(mutant(reader, dice))
                end = attempt(reader, path)
                refused += end == "refused"
                if end not in ("read", "refused"):
                    failures.append(f"{_kept(path, f'{number}_{k}')}: {end}")
            counts |= {reader.name: reader.files, f"{reader.name} refused": refused}
    return Outcome(counts, tuple(failures))


def readers() -> tuple[Reader, ...]:
    return (*_robot_readers(), *_tree_readers(), *_mesh_readers(), *_data_readers())


def _robot_readers() -> tuple[Reader, ...]:
    arm, files = read("ur5e"), _files("*.toml")
    return (
        Reader("toml", 1200, "arm.toml", files, read, _text),
        Reader("check", 100, "arm.toml", files, check, _text),
        *(
            Reader(kind, 150, f"ur.{kind}", _files(f"ur.{kind}"), of_arm, _text)
            for of_arm in [partial(apply_calibration, arm)]
            for kind in ("yaml", "conf")
        ),
    )


def _tree_readers() -> tuple[Reader, ...]:
    tree = opened(CORPUS / "arm.urdf").tree
    kinds = {"urdf": 1000, "xacro": 900, "xml": 700, "sdf": 1000}
    return (
        *(
            Reader(kind, files, f"arm.{kind}", _files(f"*.{kind}"), _opened, _text)
            for kind, files in kinds.items()
        ),
        *(
            Reader(f"isolated {kind}", 10, f"arm.{kind}", _files(f"*.{kind}"), read, _text)
            for kind in kinds
        ),
        Reader("srdf", 1800, "arm.srdf", _files("*.srdf"), lambda file: _groups(file, tree), _text),
    )


def _mesh_readers() -> tuple[Reader, ...]:
    trimesh = import_module("trimesh")
    box = trimesh.creation.box((1, 1, 1))
    kinds = {"stl": None, "obj": _text, "ply": None, "dae": _text, "glb": None}
    return tuple(
        Reader(kind, 100, f"part.{kind}", (_exported(box, kind),), _drawn, mutation or _bytes)
        for kind, mutation in kinds.items()
    )


def _exported(surface: Any, kind: str) -> bytes:
    found = surface.export(file_type=kind)
    return found.encode() if isinstance(found, str) else bytes(found)


def _drawn(file: Path) -> object:
    arm = file.with_name("drawn.urdf")
    arm.write_text(ARM.format(file.name), encoding="utf-8")
    return drawing(arm)


def _bytes(content: bytes, dice: random.Random) -> bytes:
    return mutated_bytes(content, dice, content)


def _data_readers() -> tuple[Reader, ...]:
    robot = chasles.load("scara")
    motion = MotionSequence(robot, robot.q_reference).move(
        robot.q_reference + 0.01, "quintic", duration=1
    )
    region = workspace(robot, 100, resolution=5, progress=False)
    small = tiny.manifest() | {"files": dict.fromkeys(("tiny.c", "tiny.h"), "0" * 64)}
    manifests = (
        *(json.dumps(small).encode(),) * 3,
        (GENERATED / "four_bar" / "manifest.json").read_bytes(),
    )
    measured = partial(read_measurements, robot=robot)
    moved = partial(Trajectory.load, robot=robot)
    stored = _saved(motion.sample(5))
    return (
        Reader("measurements", 1500, "table.csv", _files("po*.csv"), measured, _text),
        Reader("motions", 1500, "motion.csv", _files("motion.csv"), moved, _text),
        Reader("trajectories", 400, "motion.npz", stored, moved, mutated_archive),
        Reader("workspaces", 270, "region.npz", _saved(region), Workspace.load, mutated_archive),
        Reader("manifests", 300, "manifest.json", manifests, _manifest, mutated_json_text),
    )


def _files(pattern: str) -> tuple[bytes, ...]:
    found = tuple(path.read_bytes() for path in sorted(CORPUS.glob(pattern)))
    assert found, pattern
    return found


def _saved(result: Trajectory | Workspace) -> tuple[bytes, ...]:
    with TemporaryDirectory() as folder:
        file = Path(folder) / "result.npz"
        result.save(file)
        return (file.read_bytes(),)


def _text(content: bytes, dice: random.Random) -> bytes:
    return mutated(content.decode(), dice).encode()


def _opened(file: Path) -> object:
    try:
        return opened(file).robot(None, None, None)
    except NotExact as error:
        # In normal use, the process pool adds the file name to the error.
        raise DescriptionError(f"{file}: {error}") from error


def _groups(file: Path, tree: KinematicTree) -> object:
    return [group_ends(file, tree, group) for group in ("arm", "both")]


def _manifest(file: Path) -> object:
    return read_manifest(file.parent)


def mutant(reader: Reader, dice: random.Random) -> bytes:
    content = dice.choice(reader.corpus)
    if dice.random() < BYTEWISE:
        return mutated_bytes(content, dice, dice.choice(reader.corpus))
    return reader.mutation(content, dice)


def attempt(reader: Reader, path: Path) -> str:
    """Read a file, and return "read", "refused" or a description of the failure."""
    try:
        with at_most(SECONDS):
            reader.read(path)
    except OutOfTime as error:
        return f"endless: {error}"
    except ChaslesError as error:
        return "refused" if str(path.parent) in str(error) else f"no file in: {error}"
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__}: {error} ({place.filename}:{place.lineno})"[:300]
    return "read"


def _kept(path: Path, number: str) -> Path:
    KEPT.mkdir(parents=True, exist_ok=True)
    kept = KEPT / f"{number}_{path.name}"
    kept.write_bytes(path.read_bytes())
    return kept


CAMPAIGN = Campaign(
    "readers",
    "A mutated file of any kind is read, or refused with an error that states the file.",
    trial,
)
