"""What a shell is told about how a command line goes on; needs argcomplete."""

import argparse

import argcomplete
from argcomplete.completers import BaseCompleter, FilesCompleter

from chasles import robots
from chasles.library import shelf


class _RobotsAndFiles(BaseCompleter):
    """Files, and before them the names of robots where one is wanted."""

    def __call__(
        self,
        *,
        prefix: str,
        action: argparse.Action,
        parser: argparse.ArgumentParser,  # noqa: ARG002
        parsed_args: argparse.Namespace,  # noqa: ARG002
    ) -> list[str]:
        names = [*robots(), *shelf()] if action.dest in ("robot", "robots") else []
        return [*names, *FilesCompleter()(prefix)]


def complete(parser: argparse.ArgumentParser) -> None:
    """Tells the shell how its line goes on, and ends the process."""
    argcomplete.autocomplete(parser, default_completer=_RobotsAndFiles())
