"""One person's way through the items of a run: show an item, wait for the start, drive it, tell how it went, go on.

The drive itself runs in a thread of its own at a fixed rate; this session, on the event loop, only carries words
between the page, the drive and the run folder.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from statistics import fmean

from chauffeur.bench.kernel.store import Row, StorageError
from chauffeur.bench.lampilot.families import family_of
from chauffeur.bench.lampilot.human import HandTrace, drive_by_hand, noted
from chauffeur.bench.lampilot.human_run import HumanRun
from chauffeur.bench.lampilot.metrics import points
from chauffeur.bench.lampilot.referee import LampilotReferee
from chauffeur.concept import RESULT_LABELS, ChauffeurError, Observation
from chauffeur.concept.results import result_of_stored
from chauffeur.hmi import words
from chauffeur.hmi.wheel.commands import COUNTDOWN_S, WheelCommands, WheelInstant
from chauffeur.hmi.wheel.mailbox import Mailbox
from chauffeur.hmi.wheel.pace import Clock
from chauffeur.hmi.wheel.protocol import PageMessage, Verb
from chauffeur.hmi.wheel.scene import Json, road_message, situation, tick_message
from chauffeur.hmi.wheel.screen import WheelScreen
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway.dblv1 import Item

_SCORES = (
    ("ttc", "lampilot-ttc-v1"),
    ("speed_variance", "lampilot-speed-variance-v1"),
    ("time_efficiency", "lampilot-time-efficiency-v1"),
    ("score", "lampilot-score-v1"),
)
"""Columns of a result row, and the metrics they are called after."""


@dataclass(frozen=True, slots=True)
class Seat:
    """An item ready to be driven: its world stands at the start."""

    item: Item
    world: HighwayWorld
    start: Observation


class WheelSession:
    """A run being driven."""

    def __init__(self, run: HumanRun, clock: Clock, utc: Callable[[], str]) -> None:
        """Prepare to drive what is left of a run; call it on the event loop that will carry the session.

        Args:
            run: The run folder.
            clock: Time of the drives.
            utc: The date and time, ISO 8601 UTC, for the record of attempts.
        """
        self.screen = WheelScreen()
        self._run = run
        self._clock = clock
        self._utc = utc
        self._mailbox: Mailbox | None = None
        self._awaited: tuple[Verb, str, asyncio.Event] | None = None

    def hear(self, said: PageMessage) -> None:
        """A word of the page. Words that do not fit the moment are dropped."""
        if self._awaited is not None and self._awaited[:2] == (said.verb, said.item):
            self._awaited[2].set()
        if self._mailbox is None:
            return
        if said.verb == "keys":
            self._mailbox.press(said.keys, said.number)
        elif said.verb in ("pause", "go", "give_up"):
            self._mailbox.wish(said.verb)

    async def drive_all(self) -> None:
        """Drive every item that is left, then score the run.

        A drive going on when this is cancelled is ended, kept and counted as given up.

        Raises:
            ChauffeurError: The run folder cannot be read or written.
        """
        while (item := self._run.next_item()) is not None:
            self._stage("loading")
            seat = await asyncio.to_thread(self._sit_down, item)
            if seat is None:
                continue
            self.screen.forget("tick")
            self.screen.show(self._item_message(seat))
            self._stage("ready")
            await self._until("start", item.id)
            await asyncio.to_thread(self._run.begin, item, self._utc())
            trace, row = await self._drive(seat)
            await self._keep(item, trace, row)
            await self._until("next", item.id)
        rows = await asyncio.to_thread(self._run.score)
        self._stage("done", **self._tally(rows))

    def _sit_down(self, item: Item) -> Seat | None:
        world = HighwayWorld()
        try:
            start = world.reset(item.scenario)
            LampilotReferee(world, item.scenario)  # a goal that cannot apply to this start says so here
        except ChauffeurError as error:
            self._run.skip(item, error)
            return None
        self._run.describe(item, world)
        return Seat(item, world, start)

    async def _drive(self, seat: Seat) -> tuple[HandTrace, Row]:
        loop = asyncio.get_running_loop()
        mailbox = self._mailbox = Mailbox(self._clock)
        self._stage("driving")

        def show(instant: WheelInstant) -> None:
            loop.call_soon_threadsafe(self.screen.show, tick_message(instant))

        def drive() -> tuple[HandTrace, Row]:
            command_source = WheelCommands(seat.world, mailbox, self._clock, show, assist=self._run.config.assist)
            happened = drive_by_hand(seat.world, seat.item.scenario, command_source)
            return command_source.trace(), happened

        driven = loop.run_in_executor(None, drive)
        try:
            trace, row = await asyncio.shield(driven)
        except asyncio.CancelledError:
            mailbox.wish("give_up")
            self._run.finish(seat.item, *await driven)
            raise
        finally:
            self._mailbox = None
        self.screen.show({"t": "tick", "phase": "over", "seq": 0} | situation(seat.world.observe()))
        return trace, row

    async def _keep(self, item: Item, trace: HandTrace, row: Row) -> None:
        """Store a drive; when that fails it is said, and tried again as often as the person asks."""
        result = _result_message(trace, noted(row, trace) | points(row, self._run.ruler_id))
        while True:
            try:
                await asyncio.to_thread(self._run.finish, item, trace, row)
            except StorageError as error:
                self._stage("result", **result, unsaved=f"Not stored yet: {error}")
                await self._until("next", item.id)
            else:
                break
        rows = await asyncio.to_thread(self._run.rows)
        self._stage("result", **result, unsaved="", **self._tally(rows))

    async def _until(self, verb: Verb, item: str) -> None:
        event = asyncio.Event()
        self._awaited = (verb, item, event)
        await event.wait()
        self._awaited = None

    def _stage(self, stage: str, **more: object) -> None:
        self.screen.show({"t": "stage", "stage": stage, **more})

    def _item_message(self, seat: Seat) -> Json:
        config = self._run.config
        return {
            "t": "item",
            "id": seat.item.id,
            "place": self._run.items.index(seat.item) + 1,
            "of": len(self._run.items),
            "command": seat.item.command,
            "family": family_of(seat.item.task),
            "simulated": words.SIMULATED,
            "driver": config.driver,
            "assist": config.assist,
            "countdown": COUNTDOWN_S,
            "road": road_message(seat.start),
            "start": situation(seat.start),
        }

    def _tally(self, rows: list[Row]) -> Json:
        done = [row for row in rows if row["success"]]
        return {
            "driven": len(rows),
            "planned": len(self._run.items),
            "successes": len(done),
            "collisions": sum(bool(row["collision"]) for row in rows),
            "mean_score": round(fmean(float(row["score"]) for row in done), 1) if done else None,
            "folder": str(self._run.folder),
        }


def _result_message(trace: HandTrace, row: Row) -> Json:
    result = result_of_stored(row["outcome"], "")
    return {
        "label": RESULT_LABELS[result],
        "tone": words.RESULT_TONES[result],
        "outcome": row["outcome"],
        "detail": row["detail"],
        "seconds": round(row["steps"] * trace.period_s, 1),
        "scores": [[words.metric_name(metric), row[column]] for column, metric in _SCORES],
        "success": row["success"],
        "late": trace.late,
    }
