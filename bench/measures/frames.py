"""``python -m bench view`` measures the computing time of a frame of the live view.

While a slider is dragged, each frame shows the robot, its other inverse solutions as transparent
ghosts, and joints near a limit in color. While the tool handle is dragged, the inverse kinematics
function determines the configuration. The table has a separate column for the time to compute the
ghosts of other assembly modes. MAX_MS does not limit the times in this column.
"""

import time
from collections.abc import Callable, Sequence

import numpy as np
from rich.table import Table

import chasles
from chasles.view.display import Display, Displayed
from chasles.view.slider_units import slider_units

from ..report import out

MAX_MS = 2.0
"""Maximum computing time of a frame [ms]."""
ROUNDS, FRAMES = 15, 20
STEP = 0.003
"""Slider motion per frame, divided by the range of the slider. The value is typical of a drag at 30
frames per second."""


def run(robots: Sequence[str]) -> int:
    """Print the time per frame of each robot (default: all robots).

    Return 1 if the time per frame of any robot exceeds MAX_MS.
    """
    names = robots or chasles.robots()
    table = Table(title="The computing for a frame, least of several runs")
    for name in ("robot", "bodies", "ghosts", "slider [ms]", "tool [ms]", "modes [ms]"):
        table.add_column(name, justify="left" if name == "robot" else "right")
    slow = 0
    for name in names:
        display = Display(chasles.load(name))
        configurations = _path(display)
        by_slider = _least(lambda d=display, p=configurations: _slid(d, p))
        by_tool = _least(lambda d=display, p=configurations: _dragged(d, p))
        by_modes = f"{_least(lambda d=display, p=configurations: _in_all_modes(d, p)):.2f}"
        most = max(int(display.ghosts(displayed).scales.sum()) for displayed in configurations)
        bodies = len(display.skeleton.bodies)
        times = [f"{by_slider:.2f}", f"{by_tool:.2f}", by_modes if display.most_modes else ""]
        table.add_row(name, str(bodies), str(most), *times)
        slow += max(by_slider, by_tool) > MAX_MS
    out.print(table)
    out.print(f"{len(names) - slow} of {len(names)} robots need at most {MAX_MS:g} ms")
    return int(slow > 0)


def _path(display: Display) -> list[Displayed]:
    """Return a path of configurations that begins at the start configuration."""
    units = slider_units(display.robot, display.start.q)
    step = STEP * np.array([unit.upper - unit.lower for unit in units])
    inwards = np.where(display.start.q < [(u.lower + u.upper) / 2 for u in units], 1.0, -1.0)
    found = [display.start]
    for k in range(1, FRAMES + 1):
        found.append(display.at(display.start.q + k * inwards * step, found[-1]))
    return found


def _slid(display: Display, configurations: list[Displayed]) -> None:
    _shown(display, configurations, lambda displayed, last: display.at(displayed.q, last))


def _dragged(display: Display, configurations: list[Displayed]) -> None:
    _shown(display, configurations, lambda displayed, last: display.reaching(displayed.tool, last))


def _shown(
    display: Display,
    configurations: list[Displayed],
    moved: Callable[[Displayed, Displayed], Displayed],
) -> None:
    """Compute all frames of a path, each from the previous frame."""
    last = configurations[0]
    for displayed in configurations[1:]:
        last = moved(displayed, last)
        display.ghosts(last)
        display.limits(last)


def _in_all_modes(display: Display, configurations: list[Displayed]) -> None:
    for displayed in configurations[1:] if display.most_modes else ():
        display.modes(displayed)


def _least(work: Callable[[], None]) -> float:
    """Return the minimum processor time per frame [ms]."""
    times = []
    for _ in range(ROUNDS):
        begin = time.thread_time()
        work()
        times.append(time.thread_time() - begin)
    return 1000 * min(times) / FRAMES
