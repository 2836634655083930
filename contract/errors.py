"""All errors of chasles, for the compiler and the runtime."""


class ChaslesError(Exception):
    """Base class of every error that chasles raises."""


class InputError(ChaslesError):
    """An argument has an invalid type or value.

    Base class of `InputTypeError` and `InputValueError`.
    """


class InputTypeError(InputError, TypeError):
    """An argument is missing, does not contain real numbers, or cannot be written to."""


class InputValueError(InputError, ValueError):
    """An argument has the right type, but its value or shape is invalid."""


class ShapeError(InputValueError):
    """An argument has the wrong shape."""


class DescriptionError(ChaslesError, ValueError):
    """A robot description is invalid or cannot be compiled.

    Attributes:
        file: Path of the file as passed by the caller, or "" for a description built in Python.
        line: Line number, starting at 1, or None if unknown.
        field: Dotted path of the invalid field, such as ``joints[1].alpha``, or "" if the error
            concerns no single field.
        value: The invalid value in the description, or None if the error concerns no value.
        expected: A description of valid values, or "" if only the message describes them.
    """

    def __init__(
        self,
        message: str,
        *,
        file: str = "",
        line: int | None = None,
        field: str = "",
        value: object = None,
        expected: str = "",
    ) -> None:
        # Pickle restores the message from `args`, and the other attributes from `__dict__`.
        super().__init__(message)
        self.file, self.line, self.field = file, line, field
        self.value, self.expected = value, expected


class LoopError(DescriptionError):
    """The loops of a robot description do not close at the reference configuration.

    Attributes:
        closure_error: Smallest closure error found (meter), or None if unknown. The closure error
            is the distance between the two frames that the closure connects. For a strut, the
            closure error is the difference between the strut length and the distance of the strut
            ends.
        remedies: Changes of the description that would close the loop, smallest change first. Each
            remedy names a length, angle or coordinate, and the interval of values for which the
            loop closes.
    """

    def __init__(
        self, message: str, *, closure_error: float | None = None, remedies: tuple[object, ...] = ()
    ) -> None:
        super().__init__(message)
        self.closure_error, self.remedies = closure_error, remedies


class DerivationError(ChaslesError):
    """The compiler is missing or could not derive a robot.

    The message contains the output of the compiler.
    """


class OutOfReachError(ChaslesError, ValueError):
    """A loop does not close, or a pose is out of reach. The message names the loop."""


class SingularityError(OutOfReachError):
    """The result is not defined at this pose.

    For example, rates are not defined at a dead point.
    """


class UnknownRobotError(ChaslesError, LookupError):
    """No robot has this name, or the path does not lead to a robot."""


class MissingFunctionError(ChaslesError, AttributeError):
    """The robot lacks a function or method. The message states the reason and names substitutes."""


class NotInstalledError(ChaslesError, ImportError):
    """An optional package is not installed. The message contains the installation command."""


class KernelError(ChaslesError):
    """A robot's compiled functions cannot be built, found or opened.

    Base class of CompilerNotFoundError, CompileError, CacheError, ManifestError and MismatchError.
    """


class CompilerNotFoundError(KernelError):
    """No C compiler was found to compile the generated C."""


class CompileError(KernelError):
    """The C compiler rejected the generated C. The message contains the compiler's output."""


class CacheError(KernelError, OSError):
    """The folder for compiled libraries and derived robots cannot be used."""


class ManifestError(KernelError, ValueError):
    """A `manifest.json` has an unsupported form. The message names file, field and value."""


class MismatchError(KernelError):
    """Generated files, a robot or a compiled library differ from the recorded content."""
