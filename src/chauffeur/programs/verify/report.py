"""What the verifier says of a program."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from chauffeur.programs.verify.values import Value

LoopVerdict = Literal["yields", "bounded", "unknown", "endless"]


@dataclass(frozen=True, slots=True)
class Argument:
    """What a parameter of a driving API can be given at one place.

    Attributes:
        name: Parameter.
        value: Every value it may get.
    """

    name: str
    value: Value


@dataclass(frozen=True, slots=True)
class CallSite:
    """A place of the program that may call a driving API.

    Attributes:
        name: API name.
        line, column: Where (line 1-based, column 0-based).
        arguments: What is given, in the catalogue's order; a parameter that is left out is not there.
        guarded: Whether an error of the call may be caught by the program itself.
        in_library: Whether it stands in the library; its line is counted there.
    """

    name: str
    line: int
    column: int
    arguments: tuple[Argument, ...] = ()
    guarded: bool = False
    in_library: bool = False

    def argument(self, name: str) -> Value | None:
        """What a parameter can be; None where it is left out."""
        return next((argument.value for argument in self.arguments if argument.name == name), None)


@dataclass(frozen=True, slots=True)
class LoopReport:
    """A loop that may be reached.

    Attributes:
        line: Where.
        verdict: `yields`: every pass gives control back; `bounded`: it ends after at most `passes`; `endless`: it never
            yields and only an error ends it; `unknown`: none of these is proven.
        passes: Bound of the passes; None where there is none, or where it is the length of what the loop walks.
        reason: In words.
        in_library: Whether it stands in the library.
    """

    line: int
    verdict: LoopVerdict
    passes: int | None
    reason: str
    in_library: bool = False


@dataclass(frozen=True, slots=True)
class VerificationNote:
    """Something a program says but does not mean.

    Attributes:
        line: Where.
        code: `unreachable`, `overwritten` or `both-sides`.
        reason: In words, with the line that is to blame.
        wish: Whether it is about a wish for the car.
        in_library: Whether it stands in the library.
    """

    line: int
    code: Literal["unreachable", "overwritten", "both-sides"]
    reason: str
    wish: bool = True
    in_library: bool = False


@dataclass(frozen=True, slots=True)
class Verification:
    """Everything found out of one program.

    Attributes:
        calls: Every driving-API call that may be reached, in line order.
        loops: Every loop that may be reached, in line order.
        notes: Unreachable statements and wishes, wishes that never take effect, wishes that contradict each other.
        unreachable: Lines of the program's own statements that are never reached, in order.
        complete: Whether the analysis came to its end. If not, `calls` are all calls of the text with anything as
            arguments, every loop is `unknown`, and nothing is said to be unreachable.
        problem: Why it did not.
    """

    calls: tuple[CallSite, ...] = ()
    loops: tuple[LoopReport, ...] = ()
    notes: tuple[VerificationNote, ...] = ()
    unreachable: tuple[int, ...] = ()
    complete: bool = True
    problem: str = ""
