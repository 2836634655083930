"""All errors of chasles, for the compiler and the runtime."""


class ChaslesError(Exception):
    """Base class of every error that chasles raises."""


class InputError(ChaslesError):
    """An argument cannot be used; root of `InputTypeError` and `InputValueError`."""


class InputTypeError(InputError, TypeError):
    """An argument is missing, does not hold real numbers, or cannot be written to."""


class InputValueError(InputError, ValueError):
    """An argument has the right type, but its value or shape is invalid."""


class ShapeError(InputValueError):
    """An argument has the wrong shape."""


class DerivationError(ChaslesError):
    """The compiler could not derive a robot, or is not installed; holds the compiler's output."""


class OutOfReachError(ChaslesError, ValueError):
    """A loop does not close, or a pose is out of reach; the message names the loop."""


class SingularityError(OutOfReachError):
    """The pose exists, but the result is not defined there, such as rates at a dead point."""


class UnknownRobotError(ChaslesError, LookupError):
    """No robot has this name, or the path does not lead to a robot."""


class MissingFunctionError(ChaslesError, AttributeError):
    """The robot lacks a function or method; states the reason and names substitutes."""


class NotInstalledError(ChaslesError, ImportError):
    """An optional package is not installed; the message has the command that installs it."""


class KernelError(ChaslesError):
    """The compiled functions of a robot cannot be made, found or opened; root of five errors."""


class CompilerNotFoundError(KernelError):
    """No C compiler was found to compile the generated C."""


class CompileError(KernelError):
    """The C compiler refused the generated C; holds the compiler's output."""


class CacheError(KernelError, OSError):
    """The folder for compiled libraries and derived robots cannot be used."""


class ManifestError(KernelError, ValueError):
    """A `manifest.json` has an unsupported form; the message names file, field and value."""


class MismatchError(KernelError):
    """Generated files, a robot or a compiled library differ from the recorded content."""
