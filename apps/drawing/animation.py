"""Animations of motions: Pillow writes GIF files, and ffmpeg writes MP4 files."""

from __future__ import annotations

import math
import os
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chasles import ChaslesError, InputValueError, NotInstalledError, Robot
from chasles.contract import as_path, check_type, output_file, requires

from .figure import figure_of, rows_of
from .lettering import Places
from .scene import Scene, scenes
from .skeleton import Skeleton, skeleton
from .views import views_of

FloatArray = NDArray[np.float64]
_MAX_FPS = 1000
_SWEEP, _SWEEP_LENGTH = math.radians(45), 0.15
"""Largest displacement of a coordinate in each direction. An angle is in radians, and a length is
relative to the robot size."""
_SWEEP_TIME, _FEWEST, _PARTS = 2.0, 9, 33
"""Duration of a coordinate's motion [s], minimum number of frames, and number of configurations at
which the closure of the loops is checked."""
_HALO = 1.6
"""Width of the background around the letters of a label [points]."""
_PERIOD = 4.0
"""Duration of the motion of a single coordinate [s]."""
_DOTS = 200
"""Pixels per inch."""


def animate(
    robot: Robot,
    trajectory: Any,
    file: str | os.PathLike[str],
    *,
    views: Sequence[str] | None = None,
    fps: float = 20.0,
) -> Path:
    """Write an animation of a robot that moves and traces its tool path.

    Args:
        robot: The robot, from `chasles.load`.
        trajectory: A `Trajectory`, `Motion` or `MotionSequence`, shown in real time, or coordinates
            q (k, n) [rad or m], shown one per frame. With None, the robot starts at the default
            configuration of `draw`, and moves one coordinate after another within its limits. The
            coordinate of a robot with n = 1 moves through a full turn or its range.
        file: The file to write, .gif or .mp4. An .mp4 file needs ffmpeg, from the system or from
            `pip install 'chasles[film]'`.
        views: One or more of the views of `draw`. The default is "plane" for planar robots and
            "axonometric" for other robots.
        fps: Frames per second, at most 1000.

    Returns:
        The path of the written file.

    Raises:
        InputValueError: The file suffix, a view or `fps` is invalid, or the trajectory belongs to a
            different robot.
        ShapeError: The coordinates do not have the shape (k, n).
        NotInstalledError: Matplotlib or Pillow (`pip install 'chasles[draw]'`), or the program
            ffmpeg for an .mp4 file, is not installed.
        ChaslesError: The program ffmpeg fails.
        OutOfReachError: The loops of the robot do not close at a configuration of the trajectory.
    """
    check_type("animate: robot", robot, Robot)
    target = as_path("animate: file", file)
    if not (isinstance(fps, int | float) and 0 < fps <= _MAX_FPS):
        raise InputValueError(
            f"animate: fps: expected more than 0 and at most {_MAX_FPS}, got {fps!r}"
        )
    if target.suffix not in (".gif", ".mp4"):
        raise InputValueError(f"animate: file: expected .gif or .mp4, got {target.name!r}")
    ffmpeg = _ffmpeg(target) if target.suffix == ".mp4" else ""
    if trajectory is None:
        rows = _sweep(skeleton(robot), fps)
    else:
        rows = rows_of(robot, _frames(trajectory, fps), "animate: trajectory")
    pictures = list(_pictures(robot, rows, views))
    with output_file(target) as output:
        if ffmpeg:
            _write_film(ffmpeg, output, pictures, fps)
        else:
            _write_gif(output, pictures, fps)
    return target


def _frames(trajectory: Any, fps: float) -> Any:
    """Return the configurations of all frames of a trajectory or a motion."""
    sampled = trajectory.sample(fps) if hasattr(trajectory, "sample") else trajectory
    if not hasattr(sampled, "q_at"):
        return sampled
    t_start, t_end = sampled.t[0], sampled.t[-1]
    n_frames = 1 + max(round(fps * (t_end - t_start)), 1)
    return replace(sampled, q=sampled.q_at(np.linspace(t_start, t_end, n_frames)))


def _sweep(bodies: Skeleton, fps: float) -> FloatArray:
    """Return configurations (k, n) that move one coordinate after another."""
    robot, q = bodies.robot, bodies.q_drawn
    units = np.array([coordinate.unit for coordinate in robot.coordinates])
    reach = np.where(units == "rad", _SWEEP, _SWEEP_LENGTH * bodies.size)
    count = max(round(fps * _SWEEP_TIME), _FEWEST)
    if robot.n == 1:
        count, reach = max(round(fps * _PERIOD), _FEWEST), np.where(units == "rad", np.pi, np.inf)
        turn = q + np.linspace(0, 2 * np.pi, count, endpoint=False)[:, None]
        if units[0] == "rad" and robot.is_within_limits(turn).all() and _closes(bodies, turn).all():
            return np.asarray(turn)
    low, high = np.fmax(robot.lower, q - reach), np.fmin(robot.upper, q + reach)
    s = np.sin(np.linspace(0, 2 * np.pi, count))
    rows = []
    for k in range(robot.n):
        way = np.where(np.arange(robot.n) == k, 1.0, 0.0)
        up, down = (_closed(bodies, q, (end[k] - q[k]) * way) for end in (high, low))
        rows.append(q + np.where(s > 0, s, 0)[:, None] * up - np.where(s < 0, s, 0)[:, None] * down)
    found = np.concatenate(rows)
    # Loops that are solved by iteration may fail between the tested configurations.
    return found[_closes(bodies, found)]


def _closes(bodies: Skeleton, q: FloatArray) -> NDArray[np.bool_]:
    """Return a mask (k,) of the configurations (k, n) with closed loops."""
    return np.asarray(np.isfinite(bodies.poses(q)).all(axis=(1, 2, 3)))


def _closed(bodies: Skeleton, q: FloatArray, move: FloatArray) -> FloatArray:
    """Return the longest initial part of a displacement along which all loops stay closed."""
    parts = np.linspace(0, 1, _PARTS)
    closes = _closes(bodies, q + parts[:, None] * move)
    closed = int(np.argmin(closes)) if not closes.all() else _PARTS
    return np.asarray(parts[max(closed - 1, 0)] * move)


def _pictures(
    robot: Robot, rows: FloatArray, views: Sequence[str] | None
) -> Iterator[NDArray[np.uint8]]:
    """Yield the images (height, width, 3), all with the same axis limits."""
    with requires("chasles[draw]"):
        from matplotlib.patheffects import withStroke  # noqa: PLC0415

    bodies = skeleton(robot)
    poses = bodies.poses(rows)
    for k in np.flatnonzero(~np.isfinite(poses).all(axis=(1, 2, 3)))[:1]:
        bodies.poses(rows[k])
        raise InputValueError(f"animate: trajectory: q[{k}]: the pose is not finite")
    every = [_scenes(bodies, poses[: k + 1], poses, views) for k in range(len(rows))]
    boxes = [_around([moment[j] for moment in every]) for j in range(len(every[0]))]
    places: list[Places] = [{} for _ in boxes]
    for k, moment in enumerate(every):
        figure = figure_of(moment, (), has_path=True, boxes=boxes, places=places)
        # The first frame shows no tool path and needs no legend.
        figure.legends[0].set_visible(k > 0)
        # Label positions are fixed, and links may pass behind the labels. An outline keeps each
        # label legible.
        halo = [withStroke(linewidth=_HALO, foreground=figure.get_facecolor())]
        for label in (text for ax in figure.axes for text in ax.texts if text.get_text()):
            label.set_path_effects(halo)
        figure.set_dpi(_DOTS)
        figure.canvas.draw()
        picture = np.asarray(figure.canvas.buffer_rgba())[..., :3]
        # The video codec needs an even width and height.
        yield picture[: picture.shape[0] // 2 * 2, : picture.shape[1] // 2 * 2].copy()


def _scenes(
    bodies: Skeleton, so_far: FloatArray, poses: FloatArray, views: Sequence[str] | None
) -> list[Scene]:
    found = views_of(bodies, poses[0], None if views is None else tuple(views))
    if views is None and len(found) > 1:
        found = views_of(bodies, poses[0], ("axonometric",))
    path = bodies.tip_poses(so_far)[:, :3, 3]
    none = np.empty((0, *poses.shape[1:]))
    return scenes(bodies, so_far[-1], none, path, found, span_of=poses)


def _around(moments: list[Scene]) -> tuple[FloatArray, FloatArray]:
    """Return the bounding box of a view over all frames."""
    boxes = [scene.box for scene in moments]
    return np.min([low for low, _ in boxes], axis=0), np.max([high for _, high in boxes], axis=0)


def _ffmpeg(target: Path) -> str:
    """Return the path of ffmpeg or of the program of imageio-ffmpeg."""
    found = shutil.which("ffmpeg")
    if found is not None:
        return found
    try:
        import imageio_ffmpeg  # noqa: PLC0415 - the extra chasles[film] installs the package

        return str(imageio_ffmpeg.get_ffmpeg_exe())
    except (ImportError, RuntimeError) as error:
        raise NotInstalledError(
            f"animate: {target.name}: .mp4 files need ffmpeg, which is not installed: "
            "pip install 'chasles[film]', or install ffmpeg itself; .gif files do not need it"
        ) from error


def _write_film(ffmpeg: str, target: Path, pictures: list[NDArray[np.uint8]], fps: float) -> None:
    height, width = pictures[0].shape[:2]
    command = [ffmpeg, "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24"]
    command += ["-s", f"{width}x{height}", "-r", f"{fps:g}", "-i", "-", "-c:v", "libx264"]
    command += ["-pix_fmt", "yuv420p", "-f", "mp4", str(target)]
    data = b"".join(picture.tobytes() for picture in pictures)
    done = subprocess.run(command, input=data, capture_output=True, check=False)
    if done.returncode:
        raise ChaslesError(f"animate: {target}: ffmpeg: {done.stderr.decode().strip()}")


def _write_gif(target: Path, pictures: list[NDArray[np.uint8]], fps: float) -> None:
    with requires("chasles[draw]"):
        from PIL import Image  # noqa: PLC0415

    images = [Image.fromarray(picture) for picture in pictures]
    # One palette for all images prevents flickering colors. The palette comes from the last image,
    # because only this image shows the whole tool path.
    palette = images[-1].quantize(128)
    first, *rest = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
    first.save(target, save_all=True, append_images=rest, duration=round(1000 / fps), loop=0)
