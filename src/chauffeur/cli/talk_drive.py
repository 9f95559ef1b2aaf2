"""What `chauffeur talk` does while it drives: hands on what is typed and what the page says, and looks at the clock."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import typer

from chauffeur.cli.interrupts import Interrupts
from chauffeur.cli.lines import Lines
from chauffeur.cli.talk_screen import TalkScreen
from chauffeur.cli.talk_typed import read_line
from chauffeur.driving.live.plan_messages import TOOK_OVER
from chauffeur.driving.talk.messages import Conversation, Said, Say, Stop
from chauffeur.driving.talk.session import Talk

if TYPE_CHECKING:
    from chauffeur.hmi.cabin import Cabin

LOOK_EVERY_S: Final = 0.01
DRIVEN_FOR_S: Final = 10.0
"""So long a wish of a file that has no end of its own is driven, in the car's time, before the next line is taken."""
_MOST_AT_ONCE: Final = 100
"""Messages of the page that are taken before the drive is looked at again."""
_MOST_WAITING: Final = 64
_UNDRIVEN: Final = ("declined", "unplanned", "refused", "stale", "failed")
"""What becomes of a wish that is not driven."""


class TalkDrive:
    """The terminal and the page around one session."""

    def __init__(
        self, screen: TalkScreen, cabin: Cabin | None, given: Sequence[str] = (), every_s: float | None = None
    ) -> None:
        """Set up.

        Args:
            screen: The terminal.
            cabin: The page, None for none.
            given: Wishes that are asked one after the other, before those of a file.
            every_s: From one of them to the next, in the car's time; None for when it is done, or driven for a while.
        """
        self._screen, self._cabin, self._every_s = screen, cabin, every_s
        self._given: list[str] = list(given)
        self._were_given = bool(given)
        self._stopped = False
        self._last_s = 0.0
        self._handed_on = 0

    def tell(self, said: Said) -> None:
        """What the session says, to every screen."""
        self._screen.tell(said)
        if self._cabin is not None:
            self._cabin.tell(said)

    def run(self, session: Talk, lines: Lines, interrupts: Interrupts) -> None:
        """Drive to the end; what is still to be kept is kept when the session is left."""
        if self._cabin is not None:
            self._screen.note(f"The cabin page: {self._cabin.url}", "")
            typer.launch(self._cabin.url)
        try:
            while session.driving:
                self._read(session, lines)
                self._take_from_page(session)
                session.poll()
                if interrupts.count and not session.stopping:
                    session.take(Stop())
                typing = lines.terminal and lines.open and not session.stopping
                self._screen.refresh(lines.typed if typing else None)
            self._give_up(session)
        except KeyboardInterrupt:
            session.abort()

    @property
    def well(self) -> bool:
        """Whether every wish that was given was asked, and driven or gave way to a newer one or to the person."""
        asked = [each for each in self._screen.conversations if not each.follows and not each.spoken]
        return not self._handed_on or (len(asked) >= self._handed_on and all(map(_driven, asked)))

    def _take_from_page(self, session: Talk) -> None:
        if self._cabin is None:
            return
        for _ in range(_MOST_AT_ONCE):
            told = self._cabin.take()
            if told is None:
                return
            session.take(told)

    def _read(self, session: Talk, lines: Lines) -> None:
        """What is typed is meant now; lines of a file are meant one after the other."""
        room = lines.terminal or len(self._given) < _MOST_WAITING
        read = lines.read(LOOK_EVERY_S if room else 0.0) if room else []
        if lines.terminal:
            for line in read:
                self._line(session, line)
        else:
            self._given += [line for line in read if line.strip()]
            self._were_given = self._were_given or bool(self._given)
        if session.stopping:
            self._give_up(session)
        if session.stopping or session.busy or not self._in_turn():
            return
        if self._given:
            self._last_s = self._screen.time_s
            self._hand_on(session)
        elif self._were_given and not lines.open and not self._stopped:
            self._stopped = True
            session.take(Stop())

    def _in_turn(self) -> bool:
        """Whether the lines before are done, or have been driven for a while where they have no end of their own."""
        going = [each for each in self._screen.conversations if each.stage != "closed"]
        since_s = self._screen.time_s - self._last_s
        if self._every_s is not None and self._given and self._screen.conversations:
            return since_s >= self._every_s
        if any(each.stage != "driven" or each.ends for each in going):
            return False
        return not going or not 0.0 <= since_s < DRIVEN_FOR_S

    def _hand_on(self, session: Talk) -> None:
        line = self._given.pop(0)
        told = read_line(line, taken_over=session.taken_over)
        at_once = not isinstance(told, Say) or session.enter(told.text).way != "wish"
        self._handed_on += not at_once
        self._line(session, line)

    def _give_up(self, session: Talk) -> None:
        """Wishes that are left when the car stops, or the road ends: the session says so, and writes it down."""
        while self._given:
            self._hand_on(session)

    def _line(self, session: Talk, line: str) -> None:
        told = read_line(line, taken_over=session.taken_over)
        if told is None:
            self._screen.help()
        elif isinstance(told, str):
            self._screen.note(told)
        else:
            session.take(told)


def _driven(each: Conversation) -> bool:
    """Whether a wish was driven, to its end where it has one, or gave way."""
    if each.outcome in _UNDRIVEN or not each.outcome:
        return False
    if each.outcome != "interrupted" or each.why == TOOK_OVER:
        return True
    return each.stages.check_s is not None and not each.ends
