"""The person's memory beside the drive: what is kept, what they say of it, and their orders over it.

A profile may be locked, half a file, or on a full disk, and each of these takes time. So one thread does the work, in
order; nothing waits for it, and nothing is called remembered before it is on the disk.
"""

from __future__ import annotations

import json
import queue
import re
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final, Literal, TypeVar

from chauffeur.concept import ChauffeurError, ConfigError, Feedback, PersonId, Trip
from chauffeur.concept.data import data_home
from chauffeur.driving.talk.messages import MemoryEntry, MemoryOrder, MemoryState, Note
from chauffeur.memory.base import Memory
from chauffeur.memory.choice import chosen_memory, open_memory
from chauffeur.memory.files import private_directory, publish
from chauffeur.memory.privacy import Privacy, read_privacy, write_privacy
from chauffeur.memory.records import result_of_kept

RETRY_S: Final = 5.0
"""What could not be kept for now (a locked file, a full disk) is tried again after so long."""
CLOSE_WITHIN_S: Final = 12.0
"""How long the end of a session waits for what is still to be kept: a locked profile is waited for 10 s."""
NEWEST: Final = 8
"""Trips that are shown."""
EXPORTS: Final = "exports"

_NOT_SLUG: Final = re.compile(r"[^a-z0-9]+")


@dataclass(frozen=True, slots=True)
class Kept:
    """How a wish stands in the memory, in words.

    Attributes:
        wish: Id.
        text: For the conversation.
        trouble: What to tell beside it; empty where all is well.
    """

    wish: str
    text: str
    trouble: str = ""


@dataclass(frozen=True, slots=True)
class OpinionKept:
    """An opinion is on the disk, or will not be: whoever waited for that may go on."""

    wish: str
    feedback: Feedback


News = Kept | OpinionKept | MemoryState | Note

_T = TypeVar("_T")


@dataclass(frozen=True, slots=True)
class _Obeyed:
    """What came of an order.

    Attributes:
        note: In words.
        state: Of the memory afterwards; a note where it cannot be told.
        erased: Everything is gone.
        forgotten: Id of the trip that is gone.
    """

    note: Note
    state: MemoryState | Note | None = None
    erased: bool = False
    forgotten: str = ""


@dataclass(slots=True)
class _Entry:
    """A wish on its way into the memory.

    Attributes:
        trip: What is to be kept; None until nothing more becomes of the wish.
        state: `open`: it is still driven. `working`: with the thread. `failed`: to be tried again. The others say
            what it came to.
        opinions: Said of it and not kept yet.
        due_s: When it is tried again.
        told: Trouble that was told already.
    """

    trip: Trip | None = None
    state: Literal["open", "working", "failed", "kept", "private", "none", "gone"] = "open"
    opinions: list[Feedback] = field(default_factory=list[Feedback])
    due_s: float = 0.0
    told: str = ""


class MemoryWorker:
    """One person's memory. `poll` and the rest are for the thread that polls the drive."""

    def __init__(
        self,
        person: PersonId,
        home: Path | None = None,
        clock: Callable[[], float] = time.monotonic,
        *,
        memory: str = "",
    ) -> None:
        """Open it.

        Args:
            person: Whose.
            home: Data directory; this installation's by default.
            clock: Monotonic time, s.
            memory: Name of the memory; the chosen one if left out.
        """
        self.person, self._clock = person, clock
        self._given, self._home = home, data_home() if home is None else home
        self._name = memory or chosen_memory()
        self._entries: dict[str, _Entry] = {}
        self._work: queue.SimpleQueue[Callable[[], Callable[[], list[News]]] | None] = queue.SimpleQueue()
        self._done: queue.SimpleQueue[Callable[[], list[News]]] = queue.SimpleQueue()
        self._busy = 0
        self._privacy: Privacy | None = None
        self._memory: Memory | None = None
        # A daemon: a lock that another process never gives back must not keep this one from ending.
        self._thread = threading.Thread(target=self._run, name="memory", daemon=True)
        self._thread.start()
        self._refresh()

    def trip(self, wish: str, trip: Trip | None) -> None:
        """Nothing more becomes of a wish: keep it, or, without a trip, know that there is nothing to keep."""
        entry = self._entry(wish)
        if entry.state != "open":
            return
        entry.trip, entry.state = trip, "none" if trip is None else "failed"
        entry.due_s = 0.0

    def opinion(self, wish: str, feedback: Feedback) -> None:
        """What the person said of a wish; it waits until the wish is kept."""
        self._entry(wish).opinions.append(feedback)

    def order(self, order: MemoryOrder) -> None:
        """What the person does with their memory."""
        self._submit(lambda: self._obey(order), self._obeyed)

    def poll(self) -> list[News]:
        """What was done since the last call."""
        news: list[News] = []
        while not self._done.empty():
            self._busy -= 1
            news += self._done.get()()
        for wish, entry in self._entries.items():
            news += self._go_on(wish, entry)
        return news

    def close(self, within_s: float = CLOSE_WITHIN_S) -> list[News]:
        """Try to keep what is not kept yet, for the last time, and say what could not be."""
        news = self.poll()
        for entry in self._entries.values():
            entry.due_s = 0.0
        until_s = self._clock() + within_s
        while self._clock() < until_s:
            news += self.poll()
            if not self._busy and not any(self._wanting(entry) for entry in self._entries.values()):
                break
            time.sleep(0.01)
        self._work.put(None)
        for wish, entry in self._entries.items():
            if entry.state in ("failed", "working"):
                news.append(Kept(wish, "not remembered", f"{wish} could not be remembered. {entry.told}".strip()))
            elif entry.opinions:
                news.append(Note(f"Your opinion on {wish} could not be kept. {entry.told}".strip(), trouble=True))
        return news

    # In the thread that polls -----------------------------------------------------------------------------------------

    def _entry(self, wish: str) -> _Entry:
        return self._entries.setdefault(wish, _Entry())

    def _wanting(self, entry: _Entry) -> bool:
        """Whether something of it may still be kept, and has not failed since the end began."""
        return entry.state == "working" or (
            entry.due_s <= self._clock()
            and (entry.state == "failed" or (entry.state == "kept" and bool(entry.opinions)))
        )

    def _go_on(self, wish: str, entry: _Entry) -> list[News]:
        if entry.state in ("open", "working") or self._clock() < entry.due_s:
            return []
        if entry.state == "failed" and entry.trip is not None:
            trip, entry.state = entry.trip, "working"
            self._submit(lambda: self._remember(trip), lambda done: self._kept(wish, entry, *done))
            return []
        if not entry.opinions:
            return []
        if entry.state == "kept" and entry.trip is not None:
            feedback, name = entry.opinions[0], entry.trip.id
            entry.state = "working"
            self._submit(
                lambda: self._attach(name, feedback), lambda done: self._attached(wish, entry, feedback, *done)
            )
            return []
        why = {
            "private": "Privacy mode: your opinion is not kept.",
            "none": "There is no trip that your opinion could be kept with.",
            "gone": "The trip was erased, so your opinion is not kept.",
        }[entry.state]
        opinions, entry.opinions = entry.opinions, []
        return [Note(why), *(OpinionKept(wish, each) for each in opinions)]

    def _kept(self, wish: str, entry: _Entry, state: Literal["kept", "private", "failed"], why: str) -> list[News]:
        entry.state = state
        if state == "failed":
            return self._failed(wish, entry, why, "not remembered yet")
        entry.told = ""
        if state == "private":
            return [Kept(wish, "not remembered: privacy mode")]
        assert entry.trip is not None
        self._refresh()
        return [Kept(wish, f"remembered as trip {entry.trip.id}")]

    def _attached(self, wish: str, entry: _Entry, feedback: Feedback, found: bool | None, why: str) -> list[News]:
        assert entry.trip is not None
        entry.state = "kept"
        if found is None:
            return self._failed(wish, entry, why, f"remembered as trip {entry.trip.id}, your opinion not yet")
        entry.told = ""
        if not found:
            entry.state = "gone"
            return []  # told with the opinion, which still waits
        entry.opinions.pop(0)
        self._refresh()
        return [Kept(wish, f"remembered as trip {entry.trip.id}, with your opinion"), OpinionKept(wish, feedback)]

    def _failed(self, wish: str, entry: _Entry, why: str, text: str) -> list[News]:
        entry.due_s = self._clock() + RETRY_S
        told, entry.told = entry.told, why
        return [] if told == why else [Kept(wish, text, f"{why} It is tried again.")]

    def _refresh(self) -> None:
        self._submit(self._state, lambda state: [state])

    def _obeyed(self, done: _Obeyed) -> list[News]:
        news: list[News] = [done.note]
        for wish, entry in self._entries.items():
            forgotten = entry.trip is not None and entry.trip.id == done.forgotten
            if (done.erased or forgotten) and entry.state in ("kept", "failed"):
                entry.state = "gone"
                news.append(Kept(wish, "erased at your wish" if done.erased else "forgotten at your wish"))
        if done.state is not None:
            news.append(done.state)
        return news

    def _submit(self, work: Callable[[], _T], apply: Callable[[_T], list[News]]) -> None:
        """Have work done by the thread, and its result applied by `poll`."""

        def job() -> Callable[[], list[News]]:
            result = work()
            return lambda: apply(result)

        self._busy += 1
        self._work.put(job)

    # In the thread that works -----------------------------------------------------------------------------------------

    def _run(self) -> None:
        while (job := self._work.get()) is not None:
            self._done.put(job())

    def _opened(self) -> Memory:
        """The memory under the present settings, which another program may have changed."""
        while (privacy := read_privacy(self._home)) != self._privacy or self._memory is None:
            self._memory, self._privacy = open_memory(self._name, self._given), privacy
        return self._memory

    def _remember(self, trip: Trip) -> tuple[Literal["kept", "private", "failed"], str]:
        try:
            memory = self._opened()
            if self._privacy is not None and not self._privacy.keeps:
                return "private", ""
            memory.remember(trip)
        except Exception as error:  # noqa: BLE001 - whatever it is, the trip waits and the person is told
            return "failed", _words(error)
        return "kept", ""

    def _attach(self, trip_id: str, feedback: Feedback) -> tuple[bool | None, str]:
        try:
            return self._opened().attach_feedback(self.person, feedback, trip_id), ""
        except Exception as error:  # noqa: BLE001
            return None, _words(error)

    def _state(self) -> MemoryState | Note:
        try:
            memory = self._opened()
            trips: list[dict[str, Any]] = json.loads(memory.export(self.person))["trips"]
        except Exception as error:  # noqa: BLE001
            return Note(f"Your memory cannot be shown. {_words(error)}", trouble=True)
        assert self._privacy is not None
        days = self._privacy.retention_days
        newest = tuple(_entry_of(trip) for trip in trips[::-1][:NEWEST])
        encrypted = bool(getattr(memory, "encrypts", False))
        return MemoryState(self.person, not self._privacy.keeps, days, len(trips), newest, self._name, encrypted)

    def _obey(self, order: MemoryOrder) -> _Obeyed:
        try:
            done = self._do(order)
        except Exception as error:  # noqa: BLE001
            return _Obeyed(Note(f"That was not done. {_words(error)}", trouble=True))
        return replace(done, state=self._state())

    def _do(self, order: MemoryOrder) -> _Obeyed:
        match order.do:
            case "show":
                return _Obeyed(Note(f"What is remembered of {self.person}:"))
            case "forget_last":
                item = self._opened().forget_last(self.person)
                if item is None:
                    return _Obeyed(Note(f"Nothing is remembered of {self.person}."))
                when = item.when[:16].replace("T", " ")
                return _Obeyed(Note(f"Forgotten: “{item.instruction}” ({when})."), forgotten=item.trip_id)
            case "erase" if not order.sure:
                return _Obeyed(Note("Everything would be erased, for good. Say that you are sure.", trouble=True))
            case "erase":
                gone = self._opened().erase(self.person)
                text = f"Erased: the profile of {self.person}." if gone else f"There was no profile of {self.person}."
                return _Obeyed(Note(text), erased=True)
            case "export":
                return _Obeyed(Note(f"Everything that is kept of you was written to {self._export()}"))
            case "retention":
                days = _whole_days(order.days)
                write_privacy(replace(self._settings(), retention_days=days), self._home)
                swept = self._opened().sweep()
                kept = "until they are erased" if days is None else f"for {days} days"
                return _Obeyed(Note(f"Trips are kept {kept}, of everybody. {swept} older ones were deleted."))
            case "private":
                write_privacy(replace(self._settings(), keeps=False), self._home)
                return _Obeyed(Note("Privacy mode is on: nothing new is kept, of anybody."))
            case "public":
                write_privacy(replace(self._settings(), keeps=True), self._home)
                return _Obeyed(Note("Privacy mode is off: trips are kept."))

    def _export(self) -> Path:
        document = self._opened().export(self.person)
        folder = private_directory(self._home / EXPORTS)
        slug = _NOT_SLUG.sub("-", self.person.lower()).strip("-") or "person"
        path = folder / f"{slug}-{datetime.now(UTC):%Y%m%d-%H%M%S}.json"
        publish(path, (document + "\n").encode())
        return path

    def _settings(self) -> Privacy:
        """As they are; with nothing kept where the file is broken: what somebody may have wished is not given up."""
        try:
            return read_privacy(self._home)
        except ConfigError:
            return Privacy(keeps=False)


def _entry_of(trip: dict[str, Any]) -> MemoryEntry:
    said = "; ".join(each["text"] for each in trip["feedback"])
    return MemoryEntry(trip["trip"], trip["when"], trip["instruction"], str(result_of_kept(trip)), said)


def _whole_days(days: float | None) -> int | None:
    if days is None:
        return None
    if not days.is_integer():
        raise ConfigError(f"{days:g} is no whole number of days.", hint="Say for example 30.")
    return int(days)


def _words(error: Exception) -> str:
    return str(error) if isinstance(error, ChauffeurError) else f"{type(error).__name__}: {error}"
