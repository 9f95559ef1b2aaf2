"""Reading the on-board model's reply, and its grammar: what a reply can be, token by token and as a whole."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from chauffeur.concept import ProgramError
from chauffeur.planners.onboard.dialect import CONDITIONS, MANNERS, MAX_STEPS, SKILLS, UNITS, DialectStep, Kind, read
from chauffeur.planners.onboard.prompt import ASK, FENCE_CLOSE, FENCE_OPEN, REFUSE


@dataclass(frozen=True, slots=True)
class OnboardReply:
    """A reply read.

    Attributes:
        steps: What the program does; empty when there is none.
        source: The program's text.
        question: What the model asks back.
        refusal: Why it refuses.
    """

    steps: tuple[DialectStep, ...] = ()
    source: str = ""
    question: str = ""
    refusal: str = ""


def read_reply(text: str) -> OnboardReply:
    """Read a whole reply.

    Raises:
        ProgramError: It is no reply of the model's grammar.
    """
    if text.startswith(ASK):
        return OnboardReply(question=text.removeprefix(ASK).strip())
    if text.startswith(REFUSE):
        return OnboardReply(refusal=text.removeprefix(REFUSE).strip())
    if not text.startswith(FENCE_OPEN) or FENCE_CLOSE not in text:
        raise ProgramError("The reply is neither a program nor a question nor a refusal.")
    source = text[len(FENCE_OPEN) : text.index(FENCE_CLOSE, len(FENCE_OPEN))]
    return OnboardReply(steps=read(source), source=source)


def grammar(questions: tuple[str, ...], refusals: tuple[str, ...], *, only_program: bool = False) -> str:
    """The replies up to the end of the program, as a Lark grammar.

    Args:
        questions: Everything the model may ask back.
        refusals: Every reason it may give.
        only_program: Whether neither may come.
    """
    return "\n".join(
        (
            "start: program" if only_program else "start: program | ask | refuse",
            f"ask: {_literal(ASK)} ({_any(questions)})",
            f"refuse: {_literal(REFUSE)} ({_any(refusals)})",
            f"program: {_literal(FENCE_OPEN + _HEAD)} step{{1,{MAX_STEPS}}} {_literal(FENCE_CLOSE)}",
            r'step: waiting? (plainly | "    if " test ":\n        yield from " call "\n" | awaited)',
            r'plainly: "    yield from " call "\n"',
            r'awaited: "    while not " test ":\n        yield autopilot()\n    yield from " call "\n"',
            r'waiting: "    yield from wait(" time ")\n"',
            f"call: {' | '.join(_call(name) for name in SKILLS)}",
            f"test: {' | '.join(_test(name) for name in CONDITIONS)}",
            f"manner: {_any(tuple(chr(34) + manner + chr(34) for manner in MANNERS))}",
            *(f"{kind}: {_number(kind)}" for kind in _KINDS),
            'factored: NUMBER " * "',
            r"NUMBER: /[0-9]{1,4}(\.[0-9]{1,2})?/",
        )
    )


_HEAD: Final = "def drive():\n"
_KINDS: Final[tuple[Kind, ...]] = ("speed", "distance", "time", "factor", "lanes")


def _literal(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'


def _any(texts: tuple[str, ...]) -> str:
    return " | ".join(_literal(text) for text in texts)


def _call(name: str) -> str:
    takes = SKILLS[name].takes
    if takes is None:
        return f'{_literal(name + "(")} manner? ")"'
    return f'{_literal(name + "(")} {takes} (", " manner)? ")"'


def _test(name: str) -> str:
    kind = CONDITIONS[name][0]
    return _literal(f"{name}()") if kind is None else f'{_literal(name + "(")} {kind} ")"'


def _number(kind: Kind) -> str:
    units = [unit for unit, (what, _, _) in UNITS.items() if what == kind]
    ways = ["NUMBER", *(f'{_literal(unit + "(")} NUMBER ")"' for unit in units)]
    return f"factored? ({' | '.join(ways)})"
