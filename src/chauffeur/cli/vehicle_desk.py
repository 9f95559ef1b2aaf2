"""What is typed and said to a vehicle during `chauffeur vehicle drive`, handed to its session."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import AsyncGenerator, Coroutine
from typing import Final

from chauffeur.cli.lines import Lines, standard_input
from chauffeur.cli.vehicle_screen import VehicleScreen
from chauffeur.driving.onroad.session import VehicleSession
from chauffeur.driving.onroad.spoken import listening
from chauffeur.driving.talk.asr_process import AsrEngine
from chauffeur.driving.talk.attention import Attention
from chauffeur.driving.talk.sound import Sound
from chauffeur.driving.talk.voice import Voice
from chauffeur.driving.talk.wish_queue import Words
from chauffeur.language.meaning.turns import answer_in

_EVALUATE: Final = "evaluate"
_LISTEN_S: Final = 0.2


class Desk:
    """Takes what is typed and said to a session."""

    def __init__(self, road: VehicleSession, screen: VehicleScreen) -> None:
        self._road, self._screen = road, screen
        self._running: set[asyncio.Task[None]] = set()
        self._attention: Attention | None = None
        self.left = False

    @contextlib.asynccontextmanager
    async def open(self, engine: AsrEngine | None, sound: Sound | None, voice: Voice | None) -> AsyncGenerator[Desk]:
        """Listen as long as this is entered, if there is an engine; wishes that were taken are answered at the end."""
        async with contextlib.AsyncExitStack() as stack:
            if engine is not None:
                attention = self._attention = Attention(engine, sound, voice, self._screen.hear, self._spoken)
                await stack.enter_async_context(listening(attention, self._deaf))
                self._screen.listens(attention.engine)
            yield self
            await asyncio.gather(*self._running)

    async def take(self, line: str, spoken: Words | None = None) -> None:
        """One line: a wish, what the person says of the drive, or that they leave."""
        if self._leaves(line):
            self.left = True
            self._screen.say(self._road.leaving)
            return
        first, _, rest = line.strip().partition(" ")
        if first.lower().rstrip(":,") == _EVALUATE:
            self._screen.answer(await self._road.feedback(rest), spoken)
        else:
            source = "text" if spoken is None else "speech"
            self._screen.answer(await self._road.ask(line, source=source), spoken)

    async def read(self) -> None:
        """Lines of standard input: what is typed is meant now, what a file holds is meant in its turn. While somebody
        listens, a file that ends ends nothing."""
        with Lines(standard_input()) as lines:
            if lines.terminal:
                self._screen.say("Type a wish and press Enter. `stop`, `evaluate ...`, `end`.", style="dim")
            while not self.left and (lines.open or (self._attention is not None and not lines.terminal)):
                for line in await asyncio.to_thread(lines.read, _LISTEN_S):
                    if self.left or not line.strip() or self._answered(line):
                        continue
                    task = self._start(self.take(line))
                    if not lines.terminal or self._leaves(line):
                        await task

    def _leaves(self, line: str) -> bool:
        return self._road.enter(line).way == "leave"

    def _deaf(self, why: str) -> None:
        """Nobody listens any more; who cannot type either has nothing to wait for."""
        self._attention = None
        self._screen.trouble(why)

    def _answered(self, line: str) -> bool:
        """Whether a line was yes or no to what was heard."""
        answer = None if self._attention is None or self._attention.question is None else answer_in(line)
        if answer is None or self._attention is None:
            return False
        self._attention.confirm(answer, Words(line, ended_s=time.monotonic()))
        return True

    def _spoken(self, hotword: str, words: Words) -> None:
        line = f"{_EVALUATE} {words.text}" if hotword == _EVALUATE else words.text
        self._start(self.take(line, words))

    def _start(self, taking: Coroutine[object, object, None]) -> asyncio.Task[None]:
        task = asyncio.get_running_loop().create_task(taking)
        self._running.add(task)
        task.add_done_callback(self._running.discard)
        return task
