"""A progress bar on terminals."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec


@contextmanager
def progress_of(
    name: str, total: int, shown: bool | None = None
) -> Iterator[Callable[[int], None]]:
    """Show a progress bar with the remaining time.

    Args:
        name: Name of the task.
        total: Number of work items.
        shown: Whether to show the bar; None shows it if standard error is a terminal and rich is
            installed.

    Yields:
        A function to call with the number of items completed since its last call.
    """
    drawn = sys.stderr.isatty() if shown is None else shown
    if not drawn or find_spec("rich") is None:
        yield lambda _: None
        return
    from rich.console import Console  # noqa: PLC0415
    from rich.progress import Progress  # noqa: PLC0415

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(name, total=total)
        yield lambda count: bar.advance(task, count)
