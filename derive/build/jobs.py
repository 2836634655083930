"""Reads robot descriptions, derives robots in parallel, and writes or compares generated files."""

import json
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

from ..derivation import Derivation, derive
from ..description.cleaned_robot import cleaned
from ..description.importers.chains import chains, is_imported
from ..description.importers.identifiers import identifier, prefix
from ..description.importers.ur_calibration import apply_calibration
from ..description.robot_files import read as read_file
from ..emit.emitter import Emitter
from ..emit.languages import LANGUAGES, emitters_of, with_detail
from ..inverse.explanation import explain, explanation
from ..model.errors import ChaslesError, InputValueError
from ..model.mechanism import Described
from ..quality.model_report import model_report
from .freshness import GENERATED, Job, Report, stamp
from .generate import (
    MANIFEST,
    files_of,
    paths_of,
    put,
    strays,
    without_garbage_collection,
)
from .time_limit import at_most


def read(job: Job) -> Described:
    """Return the robot that the file of a job describes.

    The options of the job specify noise removal and factory calibration.

    Raises:
        DescriptionError: The description is invalid.
    """
    robot = _as_written(job)
    robot = robot if job.exact else cleaned(robot)
    return apply_calibration(robot, job.calibration) if job.calibration else robot


def _as_written(job: Job) -> Described:
    robot = read_file(
        job.file, base=job.base, tip=job.tip, name=job.name, arguments=job.arguments, exact=True
    )
    if not job.suffix:
        return robot
    title = f"{robot.title or robot.name} {job.suffix}"
    return replace(robot, name=prefix(f"{robot.name}_{job.suffix}"), title=title)


def robots_of(job: Job, tips: Sequence[str], groups: Sequence[str], srdf: Path | None) -> list[Job]:
    """Return one job for each robot that a file describes.

    Args:
        job: Options that all robots of the file share.
        tips: Tip links of the robots. If ``tips`` is empty, the SRDF groups or the link tree of the
            robot file define the tip links.
        groups: Names of SRDF groups.
        srdf: Path of the SRDF file, or None to read the SRDF file next to the robot file.

    Raises:
        DescriptionError: The description is invalid.
    """
    if tips:
        several = len(tips) > 1
        return [replace(job, tip=tip, suffix=identifier(tip) if several else "") for tip in tips]
    if not is_imported(job.file):
        if groups:
            raise InputValueError(f"{job.file}: --group requires a URDF, xacro or MJCF file")
        return [job]
    found = chains(job.file, job.arguments, job.base, groups, srdf)
    return [replace(job, base=base, tip=tip, suffix=suffix) for base, tip, suffix in found]


def problems(jobs: Sequence[Job]) -> list[str]:
    """Return the error messages for all robot descriptions, before any robot is derived."""
    found = []
    files: dict[str, Path] = {}
    for job in jobs:
        try:
            _emitters(job)
            with at_most(job.time_limit):
                name = read(job).name
        except ChaslesError as error:
            found.append(str(error))
            continue
        if name in files:
            found.append(f"{job.file}: robot {name!r} is also described in {files[name]}")
        files[name] = job.file
    return found


def derived(jobs: Sequence[Job], workers: int) -> Iterator[Report]:
    """Derive robots, write one folder per robot, and yield one report per robot."""
    return _each(_derive, jobs, workers)


def compared(jobs: Sequence[Job], workers: int) -> Iterator[Report]:
    """Derive robots and compare the generated files with the robots' existing folders."""
    return _each(_compare, jobs, workers)


def explained(jobs: Sequence[Job]) -> Iterator[Report]:
    """Yield a report on the inverse kinematics of each robot."""
    return (_attempt(_explain, job) for job in jobs)


def judged(jobs: Sequence[Job]) -> Iterator[Report]:
    """Report how well each robot's model suits calibration."""
    return (_attempt(_judge, job) for job in jobs)


def orphans(jobs: Sequence[Job], to: Path) -> list[str]:
    """Return the names of the generated folders that belong to no robot description."""
    names = {read(job).name for job in jobs}
    return sorted(
        path.parent.name for path in to.glob(f"*/{MANIFEST}") if path.parent.name not in names
    )


def _each(work: Callable[[Job], Report], jobs: Sequence[Job], workers: int) -> Iterator[Report]:
    workers = min(workers, len(jobs))
    if workers == 1:
        yield from (_attempt(work, job) for job in jobs)
        return
    # Forked worker processes start with SymPy and CasADi already loaded.
    with ProcessPoolExecutor(workers, mp_context=get_context("fork")) as pool:
        for done in as_completed([pool.submit(_attempt, work, job) for job in jobs]):
            yield done.result()


def _attempt(work: Callable[[Job], Report], job: Job) -> Report:
    try:
        with at_most(job.time_limit), without_garbage_collection():
            return work(job)
    except ChaslesError as error:
        return Report(False, f"{job.file}: {error}")
    except OSError as error:
        # An OSError means that no process can be started, or that the disk with temporary files is
        # full.
        return Report(False, f"{job.file}: {error}")
    except Exception:
        message = "chasles fails on this file; please report the file with these lines"
        return Report(False, f"{job.file}: {message}\n{traceback.format_exc()}")


def _explain(job: Job) -> Report:
    robot = read(job)
    lines = [*robot.notes, str(explain(robot, fixed=job.fixed))]
    return Report(True, "\n".join(lines), _warning(job, robot))


def _judge(job: Job) -> Report:
    robot = read(job)
    lines = [*robot.notes, str(model_report(robot))]
    return Report(True, "\n".join(lines), _warning(job, robot))


def _derive(job: Job) -> Report:
    started = time.perf_counter()
    robot = read(job)
    derivation = _derivation(job, robot)
    files = files_of(derivation, _emitters(job))
    folder = job.to / robot.name
    put(files, folder, shares=_shares(job))
    stamp(job, folder)
    parts = [f"{robot.name:<12} {_summary(files)}  {time.perf_counter() - started:5.2f} s"]
    cleaning = derivation.robot.cleaning
    parts += [cleaning.line] if cleaning.numbers else []
    lines = [", ".join(parts)]
    if not job.functions:
        lines.append(explanation(robot, derivation.inverse, derivation.hybrid).line)
    notes = json.loads(files[MANIFEST]).get("notes", [])
    lines += [note for note in notes if note not in parts]
    return Report(True, "\n    ".join(lines), _warning(job, derivation.robot))


def _warning(job: Job, robot: Described) -> str:
    return robot.cleaning.warning and f"warning: {job.file}: {robot.cleaning.warning}"


def _derivation(job: Job, robot: Described) -> Derivation:
    return derive(
        robot, functions=job.functions or None, fixed=job.fixed, parametric=job.parametric
    )


def _emitters(job: Job) -> tuple[Emitter, ...]:
    return with_detail(emitters_of(job.languages or LANGUAGES), job.detail)


def _compare(job: Job) -> Report:
    robot = read(job)
    files = files_of(_derivation(job, robot), _emitters(job))
    folder = job.to / robot.name
    paths = paths_of(files, folder, shares=_shares(job))
    differing = [name for name, text in files.items() if _text(paths[name]) != text]
    differing += strays([name for name in files if paths[name] == folder / name], folder)
    if differing:
        return Report(False, f"{robot.name:<12} out of date: {', '.join(differing)}")
    return Report(True, f"{robot.name:<12} agrees, {len(files)} files")


def _shares(job: Job) -> bool:
    """Whether the target folder is the folder of installed robots, which share support headers."""
    return job.to.resolve() == GENERATED.resolve()


def _summary(files: dict[str, str]) -> str:
    manifest = json.loads(files[MANIFEST])
    operations = {f["name"]: f["operations"]["total"] for f in manifest["functions"]}
    shown = [name for name in ("fk", "fk_jacobian_mixed") if name in operations]
    counts = ", ".join(f"{name} {operations[name]:4d} operations" for name in shown)
    if manifest.get("solution") == "newton":
        counts = "fk by iteration" if "fk" in operations else "more actuators than freedoms"
    size = sum(len(text.encode()) for text in files.values()) // 1024
    return f"{len(operations):2d} functions ({counts}), {size:4d} KiB"


def _text(path: Path) -> str | None:
    return path.read_bytes().decode(errors="replace") if path.is_file() else None
