"""How a program can fail, one type each. All are `ProgramError`s: the program's fault, said in words, with its line."""

from __future__ import annotations

from chauffeur.concept import ProgramError


class ProgramFaultError(ProgramError):
    """A program failed.

    Attributes:
        line: Program line (1-based) it failed at, None when no single line can be named.
    """

    def __init__(self, message: str, *, line: int | None = None, hint: str = "") -> None:
        super().__init__(message, hint=hint)
        self.line = line


class ProgramRefusedError(ProgramFaultError):
    """The static gate found something the language does not allow; nothing ran."""


class ProgramSyntaxError(ProgramFaultError):
    """The text is not a program of the language; nothing ran."""


class ProgramRaisedError(ProgramFaultError):
    """The program raised an exception and did not catch it.

    Attributes:
        exception: Name of the exception's type, e.g. `ZeroDivisionError`.
    """

    def __init__(self, message: str, *, exception: str, line: int | None = None, hint: str = "") -> None:
        super().__init__(message, line=line, hint=hint)
        self.exception = exception


class ProgramTimeError(ProgramFaultError):
    """The program computed for longer than one control period allows."""


class ProgramMemoryError(ProgramFaultError):
    """The program asked for more memory than its budget."""


class ProgramRecursionError(ProgramFaultError):
    """The program called itself too deeply."""


class ProgramCallsError(ProgramFaultError):
    """The program made more driving-API calls in one control period than its budget."""


class ProgramCrashError(ProgramFaultError):
    """The program brought its sandbox worker down; the worker is replaced and nothing else was touched."""


class BadArgumentTypeError(TypeError):
    """A driving API was called with arguments of the wrong shape or type; raised inside the program as TypeError."""


class BadArgumentValueError(ValueError):
    """A driving API was given a value that cannot be; raised inside the program as ValueError."""
