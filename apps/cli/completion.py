"""Shell completion; needs argcomplete."""

import argparse

import argcomplete
from argcomplete.completers import BaseCompleter, FilesCompleter

from chasles import robots
from chasles.library import shelf


class _RobotsAndFiles(BaseCompleter):
    """Completes file names, and robot names for arguments that accept a robot."""

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
    """Print the completions for the shell, and exit."""
    argcomplete.autocomplete(parser, default_completer=_RobotsAndFiles())
