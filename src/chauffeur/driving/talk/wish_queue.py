"""How words become a wish of the drive: written down first where books are kept, and handed on once that is on disk."""

from __future__ import annotations

from concurrent.futures import Future
from dataclasses import dataclass, replace
from typing import Final

from chauffeur.concept import Instruction, InstructionError, PersonId, Result
from chauffeur.driving.events import DriveEvent, WishEventKind
from chauffeur.driving.live.supervisor import Runtime
from chauffeur.driving.recorder import DriveRecorder
from chauffeur.driving.session import MAX_WISH_CHARACTERS, parse_wish

OVER: Final = "The drive was over before it came to this."
UNKEPT: Final = "The audit log could not be written in time; the wish is asked all the same."


@dataclass(frozen=True, slots=True)
class Words:
    """Words that are to become a wish, and when they were there.

    Attributes:
        text: What the person wants.
        spoken: Whether it was said and not typed.
        ended_s: When the person had finished saying it, or pressed Enter, by the monotonic clock.
        wait_s, recognise_s: Of speech; 0 for typed words.
        follows: Wish whose opinion this is, empty where it is none.
        confirmed: The car's question to which they are the yes; empty for none.
    """

    text: str
    spoken: bool = False
    ended_s: float = 0.0
    wait_s: float = 0.0
    recognise_s: float = 0.0
    follows: str = ""
    confirmed: str = ""


class WishQueue:
    """Hands wishes on in their order. Used from the thread that polls the drive."""

    def __init__(self, person: PersonId, books: DriveRecorder | None = None) -> None:
        """Args: whose wishes they are; where they are written down, None for nowhere."""
        self._person, self._books = person, books
        self._waiting: list[tuple[Words, Instruction]] = []
        self._keeping: tuple[Words, Instruction, Future[bool]] | None = None

    @property
    def busy(self) -> bool:
        """Whether a wish waits to be handed on."""
        return self._keeping is not None or bool(self._waiting)

    def put(self, words: Words) -> None:
        """A wish, to be handed on when it is its turn.

        Raises:
            InstructionError: It is none. It stands in the books all the same.
        """
        try:
            instruction = parse_wish(words.text, self._person)
        except InstructionError as error:
            self.pass_over(words.text, "refused", Result.DECLINED, str(error))
            raise
        source = "speech" if words.spoken else "text"
        instruction = replace(instruction, source=source, confirmed=words.confirmed)
        self._waiting.append((replace(words, text=instruction.text), instruction))

    def look(self, runtime: Runtime) -> tuple[tuple[str, Words] | None, str]:
        """Hand the next wish on, if it may be: its id and words, and what there is to tell."""
        if self._keeping is not None:
            words, instruction, kept = self._keeping
            if not kept.done():
                return None, ""
            self._keeping = None
            return (self._hand_on(runtime, instruction), words), "" if kept.result() else UNKEPT
        if not self._waiting:
            return None, ""
        words, instruction = self._waiting.pop(0)
        if self._books is None:
            return (self._hand_on(runtime, instruction), words), ""
        self._books.tell(DriveEvent("wish", runtime.next_wish, instruction.text, value=instruction))
        self._keeping = words, instruction, self._books.kept()
        return None, ""

    def give_up(self, runtime: Runtime) -> tuple[str, ...]:
        """Nothing more is handed on: the wishes it never came to, which stand in the books."""
        unasked: list[str] = []
        if self._keeping is not None:
            unasked.append(self._keeping[1].text)
            self._answer(runtime.next_wish, "unasked", Result.NOT_DONE, OVER)
        for words, _ in self._waiting:
            unasked.append(words.text)
            self.pass_over(words.text, "unasked", Result.NOT_DONE, OVER)
        self._keeping, self._waiting = None, []
        return tuple(unasked)

    def pass_over(self, text: str, kind: WishEventKind, result: Result, why: str) -> None:
        """A wish that is not handed on stands in the books all the same."""
        if self._books is not None:
            said = Instruction(text[:MAX_WISH_CHARACTERS], self._person)
            self._books.tell(DriveEvent("wish", text=said.text, value=said))
        self._answer("", kind, result, why)

    def _answer(self, wish: str, kind: WishEventKind, result: Result, why: str) -> None:
        if self._books is not None:
            self._books.tell(DriveEvent(kind, wish, why, final=True, result=result))

    def _hand_on(self, runtime: Runtime, instruction: Instruction) -> str:
        return runtime.ask(instruction.text, instruction.person, confirmed=instruction.confirmed)
