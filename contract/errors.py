"""All errors of chasles; each but the root also derives from a built-in class where one fits."""


class ChaslesError(Exception):
    """Base class of every error that chasles raises."""


class UnknownRobotError(ChaslesError, LookupError):
    """No robot has this name, or the path does not lead to a robot."""


class ManifestError(ChaslesError, ValueError):
    """A `manifest.json` has an unsupported form; the message names file, field and value."""


class SourceMismatchError(ChaslesError):
    """The SHA-256 of a generated file, or of a whole robot, differs from the recorded hash."""


class CompilerNotFoundError(ChaslesError):
    """No C compiler was found to compile the generated C."""


class CompileError(ChaslesError):
    """The C compiler refused the generated C; holds the compiler's output."""


class CacheError(ChaslesError, OSError):
    """The folder for compiled libraries and derived robots cannot be used."""


class DerivationError(ChaslesError):
    """The compiler could not derive a robot, or is not installed; holds the compiler's output."""


class LibraryMismatchError(ChaslesError):
    """A compiled library is damaged, or was compiled from other sources."""


class ShapeError(ChaslesError, ValueError):
    """An argument has the wrong shape."""


class OutOfReachError(ChaslesError, ValueError):
    """A loop of the robot does not close; names the loop, its margin and the coordinates."""


class SingularityError(OutOfReachError):
    """The pose exists, but the result is not defined there, such as rates at a dead point."""


class MissingFunctionError(ChaslesError, AttributeError):
    """The robot lacks a function or method; states the reason and names substitutes."""


class InputError(ChaslesError):
    """An argument cannot be used; root of `InputTypeError` and `InputValueError`."""


class InputTypeError(InputError, TypeError):
    """An argument is missing, is not made of real numbers, or cannot be written to."""


class InputValueError(InputError, ValueError):
    """An argument has the right type and shape, but a value outside its range."""
