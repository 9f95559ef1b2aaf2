"""What is typed to a session, as what it is told."""

from __future__ import annotations

from typing import Final, Literal

from chauffeur.driving.talk.messages import Evaluate, Hand, MemoryOrder, Say, TakeOver, Told

HELP: Final = (
    ("any words", "a wish, e.g. slow down a bit"),
    ("! or evaluate", "an opinion, e.g. !too fast"),
    ("yes, no", "whether what was heard is meant"),
    ("take over, give back", "the wheel; with it: faster, slower, left, right, brake"),
    ("me show, forget, export", "what is remembered of you: see it, forget the last trip, write it to a file"),
    ("me retention 30", "days that trips are kept, or forever"),
    ("me private, public", "keep nothing new, or keep trips again"),
    ("me erase sure", "erase everything, for good"),
    ("stop, quit", "come to a stand and end"),
)
"""What can be typed, and what it means."""

_KEYS: Final[dict[str, Literal["faster", "slower", "left", "right", "brake"]]] = {
    "faster": "faster", "slower": "slower", "left": "left", "right": "right", "brake": "brake",
}  # fmt: skip
_EVALUATE: Final = "evaluate"


def read_line(line: str, *, taken_over: bool) -> Told | str | None:
    """A line as a message; a text where it cannot be one; None where it asks for help, or says nothing.

    Args:
        line: As it was typed.
        taken_over: Whether the person has the wheel, so that keys are keys and no wishes.
    """
    text = line.strip()
    words = text.lower().split()
    match words:
        case [] | ["help"] | ["?"]:
            return None
        case ["take", "over"]:
            return TakeOver(True)
        case ["give", "back"]:
            return TakeOver(False)
        case [key] if taken_over and key in _KEYS:
            return Hand(_KEYS[key])
        case ["me", *rest]:
            return _memory(rest)
        case _:
            pass
    if text.startswith("!"):
        return Evaluate(text[1:].strip())
    if words[0].rstrip(",:") == _EVALUATE:
        return Evaluate(text[len(_EVALUATE) :].lstrip(" ,:"))
    return Say(text)


def _memory(words: list[str]) -> MemoryOrder | str:
    match words:
        case ["show"] | []:
            return MemoryOrder("show")
        case ["forget"] | ["forget", "last"] | ["forget-last"]:
            return MemoryOrder("forget_last")
        case ["erase"]:
            return MemoryOrder("erase")
        case ["erase", "sure"]:
            return MemoryOrder("erase", sure=True)
        case ["export"]:
            return MemoryOrder("export")
        case ["retention", "forever"]:
            return MemoryOrder("retention")
        case ["retention", days] if days.isdecimal():
            return MemoryOrder("retention", days=float(days))
        case ["private"] | ["privacy", "on"]:
            return MemoryOrder("private")
        case ["public"] | ["privacy", "off"]:
            return MemoryOrder("public")
        case _:
            return f"“me {' '.join(words)}” is unknown. Type help."
