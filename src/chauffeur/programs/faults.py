"""From what the sandbox reports to a typed error in words, with the program's line."""

from __future__ import annotations

from typing import Final

import pydantic_monty as monty

from chauffeur.programs.errors import (
    ProgramCrashError,
    ProgramFaultError,
    ProgramMemoryError,
    ProgramRaisedError,
    ProgramRecursionError,
    ProgramSyntaxError,
    ProgramTimeError,
)

MAX_MESSAGE_CHARS: Final = 300
"""A program chooses its exception's text; more of it is not repeated."""


def fault_of(error: monty.MontyError, feed: str) -> ProgramFaultError:
    """The fault behind an interpreter error.

    Args:
        error: What the sandbox raised.
        feed: Name the sandbox gave to the program's text; lines of other texts are not the program's.
    """
    if isinstance(error, monty.MontyCrashedError):
        if error.timed_out:
            return ProgramTimeError("The program did not stop in time; its worker was killed.")
        return ProgramCrashError("The program brought its sandbox worker down; the worker was replaced.")
    line = None
    if isinstance(error, monty.MontyRuntimeError | monty.MontySyntaxError):
        lines = [frame.line for frame in error.traceback() if frame.filename == feed]
        line = lines[-1] if lines else None
    text = str(error)[:MAX_MESSAGE_CHARS]
    if isinstance(error, monty.MontySyntaxError):
        return ProgramSyntaxError(f"The program cannot be read: {text}.", line=line)
    return _runtime_fault(text, line)


def _runtime_fault(text: str, line: int | None) -> ProgramFaultError:
    kind, _, message = text.partition(": ")
    if kind == "TimeoutError" and "time limit exceeded" in message:
        return ProgramTimeError(
            f"The program computed too long without a yield or a driving API ({message}).",
            line=line,
            hint="Every loop must reach a `yield autopilot()`.",
        )
    if kind == "TimeoutError" and "sleep limit" in message:
        return ProgramTimeError(
            "The program tried to sleep.", line=line, hint="Wait with `yield autopilot()`; each one lasts 0.1 s."
        )
    if kind == "MemoryError":
        return ProgramMemoryError("The program used too much memory.", line=line, hint="Keep no long lists or texts.")
    if kind == "RecursionError":
        return ProgramRecursionError("The program calls itself too deeply.", line=line, hint="Use a loop.")
    if kind == "NotImplementedError" and "monty syntax parser" in message:
        return ProgramSyntaxError(f"The program uses Python that its language lacks: {message}.", line=line)
    where = "" if line is None else f" in line {line}"
    return ProgramRaisedError(f"The program raised {text}{where}.", exception=kind, line=line)
