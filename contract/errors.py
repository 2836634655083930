"""The base class of all chasles exceptions, and the exceptions of the manifest reader."""


class ChaslesError(Exception):
    """Base class of every error that chasles raises."""


class UnknownRobotError(ChaslesError, LookupError):
    """No robot has this name, or the path does not lead to a robot."""


class ManifestError(ChaslesError, ValueError):
    """A `manifest.json` has an unsupported form; the message names file, field and value."""


class SourceMismatchError(ChaslesError):
    """The SHA-256 of a generated file, or of a whole robot, differs from the recorded hash."""
