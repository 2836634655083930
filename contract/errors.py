"""The root of all exceptions of chasles, and the exceptions of reading a manifest."""


class ChaslesError(Exception):
    """Root of every error that chasles itself raises."""


class UnknownRobotError(ChaslesError, LookupError):
    """No robot has this name, or the path leads to none."""


class ManifestError(ChaslesError, ValueError):
    """A `manifest.json` is not of the form that this version reads; names file, field and value."""


class SourceMismatchError(ChaslesError):
    """The SHA-256 of a generated file, or of a whole robot, is not the recorded one."""
