"""The exceptions of chasles, under one root."""


class ChaslesError(Exception):
    """Root of every error that chasles raises itself."""


class UnknownRobotError(ChaslesError, LookupError):
    """No generated robot of that name, or no folder of one at that path."""


class ManifestError(ChaslesError, ValueError):
    """A `manifest.json` is not what this version reads; names file, field and value."""


class SourceMismatchError(ChaslesError):
    """A generated file, or a whole robot, is not the one its SHA-256 was taken of."""


class CompilerNotFoundError(ChaslesError):
    """There is no C compiler to turn the generated C into a library."""


class CompileError(ChaslesError):
    """The C compiler refused the generated C; carries what it said."""


class CacheError(ChaslesError, OSError):
    """The folder for compiled libraries cannot be used."""


class LibraryMismatchError(ChaslesError):
    """A compiled library is damaged, or was compiled from something else."""


class ShapeError(ChaslesError, ValueError):
    """An argument has the wrong shape."""


class OutOfReachError(ChaslesError, ValueError):
    """A loop of the robot does not close there; names the loop, its margin and the coordinates."""


class SingularityError(OutOfReachError):
    """The pose exists, but what was asked for is not defined there, as rates at a dead point."""


class InputError(ChaslesError, TypeError):
    """An argument is missing, is not made of real numbers, or cannot be written to."""
