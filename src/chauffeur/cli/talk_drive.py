"""What `chauffeur talk` does while it drives: hands on what is typed and what the page says, and looks at the clock."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import typer

from chauffeur.cli.interrupts import Interrupts
from chauffeur.cli.lines import Lines
from chauffeur.cli.talk_screen import TalkScreen
from chauffeur.cli.talk_typed import read_line
from chauffeur.drive.talk.messages import Said, Stop
from chauffeur.drive.talk.session import Talk

if TYPE_CHECKING:
    from chauffeur.hmi.cabin import Cabin

LOOK_EVERY_S: Final = 0.01
DRIVEN_FOR_S: Final = 10.0
"""So long a wish of a file is driven, in the car's time, before the next line is taken."""
_MOST_AT_ONCE: Final = 100
"""Messages of the page that are taken before the drive is looked at again."""
_MOST_WAITING: Final = 64


class TalkDrive:
    """The terminal and the page around one session."""

    def __init__(self, screen: TalkScreen, cabin: Cabin | None) -> None:
        """Args: the terminal; the page, None for none."""
        self._screen, self._cabin = screen, cabin
        self._given: list[str] = []
        self._were_given = self._stopped = False
        self._last_s = 0.0

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
        except KeyboardInterrupt:
            session.abort()

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
            return
        self._given += [line for line in read if line.strip()]
        self._were_given = self._were_given or bool(self._given)
        if session.stopping or session.busy or not self._in_turn():
            return
        if self._given:
            self._last_s = self._screen.time_s
            self._line(session, self._given.pop(0))
        elif self._were_given and not lines.open and not self._stopped:
            self._stopped = True
            session.take(Stop())

    def _in_turn(self) -> bool:
        """Whether the line before has been driven for a while, or is done."""
        last = next(reversed(self._screen.conversations), None)
        if last is None:
            return True
        if last.stage == "driven":
            return not 0.0 <= self._screen.time_s - self._last_s < DRIVEN_FOR_S
        return last.stage == "closed"

    def _line(self, session: Talk, line: str) -> None:
        told = read_line(line, taken_over=self._screen.taken_over)
        if told is None:
            self._screen.help()
        elif isinstance(told, str):
            self._screen.note(told)
        else:
            session.take(told)
