"""What `chauffeur live` does while it drives: asks wishes in their turn, listens, and stops when it is told to."""

from __future__ import annotations

import time
from typing import Final, get_args

from chauffeur.cli.interrupts import Interrupts
from chauffeur.cli.lines import Lines
from chauffeur.cli.live_screen import QuietScreen, last_words
from chauffeur.concept import InstructionError, PersonId
from chauffeur.drive.live.books import Books
from chauffeur.drive.live.messages import Key, Report
from chauffeur.drive.live.orders import Brief, Event
from chauffeur.drive.live.remembering import Remembering
from chauffeur.drive.live.supervisor import Interaction, Replaced, Runtime
from chauffeur.drive.talk.asking import OVER, Asking, Words

STOP: Final = "stop"
"""The line that ends the drive."""
TAKE_OVER: Final = "take over"
GIVE_BACK: Final = "give back"
"""The lines with which the person takes the wheel and gives it back."""
KEYS: Final[dict[str, Key]] = {key: key for key in get_args(Key)}
"""Lines that move the car meanwhile."""

DRIVEN_FOR_S: Final = 10.0
"""So long a given wish is driven, in the car's time, before the next one is asked: some have no end of their own."""
LOOK_EVERY_S: Final = 0.05

_MOST_WAITING: Final = 64
"""Lines of a file that are read ahead."""
_WELL: Final = ("ended", "stopped")
_UNDRIVEN: Final = ("declined", "unplanned", "refused", "stale", "failed")


class LiveDrive:
    """Asks wishes, listens, and looks at the clock, until the car stands or the trip is over."""

    def __init__(
        self,
        screen: QuietScreen,
        books: Books | None,
        memory: Remembering | None,
        given: list[str],
        person: PersonId,
        every_s: float | None,
    ) -> None:
        self._screen, self._books, self._memory = screen, books, memory
        self._asking, self._every_s = Asking(person, books), every_s
        self._given = given
        self._typed: list[str] = []
        self._at_s = self._asked_at_s = self._driven_at_s = 0.0
        self._stopping = False
        self._passed_over = 0
        self.interrupts = Interrupts()
        self.well = False

    def tell(self, heard: Event | Report | Brief | Replaced) -> None:
        """What the runtime tells."""
        match heard:
            case Report():
                self._at_s = heard.tick * self._screen.dt_s
            case Event(kind="started"):
                self._driven_at_s = self._at_s
            case Event(kind="declined") if heard.offer:
                self._asking.offer(heard.text, heard.offer)
            case _:
                pass
        if self._books is not None:
            self._books.tell(heard)
        self._screen.tell(heard)
        if self._memory is not None:
            self._memory.tell(heard)

    def run(self, runtime: Runtime, lines: Lines) -> None:
        """Drive to the end."""
        self._screen.runtime = runtime
        outcome = "aborted"
        with self.interrupts:
            try:
                while runtime.driving:
                    self._look(runtime, lines)
                runtime.poll()
                ended = runtime.report is not None and runtime.report.ended
                outcome = runtime.report.outcome if ended and runtime.report is not None else "died"
            except KeyboardInterrupt:
                runtime.abort()
        runtime.stop()
        self._end(runtime, outcome)

    def _look(self, runtime: Runtime, lines: Lines) -> None:
        if lines.terminal or len(self._given) < _MOST_WAITING:
            for line in lines.read(LOOK_EVERY_S):
                self._take(runtime, line, typed=lines.terminal)
        else:
            time.sleep(LOOK_EVERY_S)
        runtime.poll()
        if not self._stopping and not runtime.taken_over:
            self._ask(runtime)
        if self.interrupts.count and not self._stopping:
            self._stop(runtime)
        typing = lines.terminal and lines.open and not self._stopping
        self._screen.refresh(lines.typed if typing else None, self._stopping)

    def _stop(self, runtime: Runtime) -> None:
        self._stopping = True
        self._screen.note("Stopping. The car comes to a stand; Ctrl-C ends at once.")
        runtime.halt()

    # Wishes -----------------------------------------------------------------------------------------------------------

    def _take(self, runtime: Runtime, line: str, *, typed: bool) -> None:
        """A line: what is typed is meant now, what a file holds is meant in its turn."""
        if self._stopping or not line.strip():
            return
        if not typed:
            self._given.append(line)
        elif is_stop(line):
            self._stop(runtime)
        elif not self._at_the_wheel(runtime, " ".join(line.lower().split())):
            self._typed.append(line)

    def _at_the_wheel(self, runtime: Runtime, said: str) -> bool:
        """Whether a line is of the person who has the wheel, takes it, or gives it back; then it is done."""
        if said == TAKE_OVER and not runtime.taken_over:
            runtime.take_over(True)
            self._screen.note(f"You have the wheel: {', '.join(KEYS)}, or {GIVE_BACK}.", "bold green")
        elif not runtime.taken_over:
            return False
        elif said == GIVE_BACK:
            runtime.take_over(False)
            self._screen.note("The car has the wheel. It holds speed and lane until you wish something.", "bold green")
        elif (key := KEYS.get(said)) is not None:
            runtime.hand(key)
        else:
            self._screen.note(f"Not while you have the wheel; {GIVE_BACK} first.")
        return True

    def _ask(self, runtime: Runtime) -> None:
        """Take up the next wish once the one before is handed on."""
        if not self._asking.busy:
            self._take_up(runtime)
        asked, note = self._asking.look(runtime)
        if note:
            self._screen.note(note)
        if asked is not None:
            self._asked_at_s = self._at_s
            self._screen.asked(asked[0], runtime.interactions[asked[0]].request.text)

    def _take_up(self, runtime: Runtime) -> None:
        if self._typed:
            self._put(self._typed.pop(0))
        elif self._given and self._in_turn(runtime):
            line = self._given.pop(0)
            if is_stop(line):
                self._stop(runtime)
            else:
                self._put(line)

    def _in_turn(self, runtime: Runtime) -> bool:
        if not runtime.interactions:
            return True
        if self._every_s is not None:
            return self._at_s - self._asked_at_s >= self._every_s
        *_, last = runtime.interactions.values()
        if last.stage == "driven":
            return self._at_s - self._driven_at_s >= DRIVEN_FOR_S
        return last.stage == "closed"

    def _put(self, line: str) -> None:
        try:
            if note := self._asking.put(Words(line)):
                self._screen.note(note)
        except InstructionError as error:
            self._screen.note(str(error))
            self._passed_over += 1

    def _end(self, runtime: Runtime, outcome: str) -> None:
        unasked = list(self._asking.give_up(runtime))
        for line in (*self._typed, *self._given):
            if not is_stop(line):
                unasked.append(line.strip())
                self._asking.pass_over(line, "not_asked", OVER)
        figures = runtime.figures()
        if self._books is not None:
            self._books.end(outcome, figures, runtime.lost_reports)
        if self._memory is not None and self._memory.trouble:
            self._screen.note(f"Not remembered: {self._memory.trouble}")
        self._screen.end(outcome, figures, tuple(unasked), last_words(runtime) if outcome == "died" else "")
        driven = all(_driven(each) for each in runtime.interactions.values())
        self.well = outcome in _WELL and driven and not unasked and not self._passed_over


def is_stop(line: str) -> bool:
    """Whether a line ends the drive."""
    return line.strip().lower() == STOP


def _driven(interaction: Interaction) -> bool:
    """Whether a wish was driven, or gave way to another one."""
    answer = interaction.answer
    if answer is None or answer.kind in _UNDRIVEN:
        return False
    if answer.kind != "interrupted" or interaction.taken_over:
        return True
    return any(event.kind == "started" for event in interaction.events)
