"""A memory of one profile per person: all that does not depend on how a profile is stored."""

from __future__ import annotations

import json
import logging
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import AbstractContextManager, contextmanager
from datetime import datetime
from pathlib import Path
from typing import Any, ClassVar, Protocol

from chauffeur.concept import (
    Context,
    Feedback,
    History,
    HistoryItem,
    Instruction,
    PersonId,
    ProfileError,
    Trip,
)
from chauffeur.language.weather import weather_of
from chauffeur.memory.columns import Columns
from chauffeur.memory.keys import KeyRing, same_name
from chauffeur.memory.privacy import Privacy, is_somebody, stamp
from chauffeur.memory.retrieval import UNCOMPARED, latest, nearest
from chauffeur.memory.similarity import Mark, mark

_log = logging.getLogger(__name__)


class StoredProfile(Protocol):
    """The open profile of one person."""

    @property
    def person(self) -> PersonId:
        """Whose profile it says it is."""
        ...

    def reading(self, wish: Mark | None = None) -> AbstractContextManager[Columns]:
        """Columns of all trips, or at least of those that bear on a wish; rows are good until the end."""
        ...

    def items(self, found: Sequence[tuple[int, float]]) -> tuple[HistoryItem, ...]:
        """Trips, by row and similarity, with their feedback: oldest feedback first."""
        ...

    def export(self) -> list[dict[str, Any]]:
        """Everything kept, oldest first, as plain values."""
        ...

    def add(self, trip: Trip, feedback: Feedback | None, when: str, keep_from: str) -> None:
        """Keep a trip; what is older than `keep_from` goes."""
        ...

    def add_feedback(self, feedback: Feedback, when: str, trip_id: str | None) -> bool:
        """Add feedback to the last trip, or to the last one with this id; False where there is none."""
        ...

    def forget_last(self) -> HistoryItem | None:
        """Remove the most recent trip; None where there is none."""
        ...

    def forget_before(self, when: str) -> int:
        """Remove the trips before a time; how many they were."""
        ...


class ProfileMemory(ABC):
    """A `Memory` of one profile per person, under a name that tells nothing of the person.

    Attributes:
        encrypts: What is kept cannot be read without its key.
    """

    encrypts: ClassVar[bool]
    _format: ClassVar[str]
    """Version of what is exported."""
    _failures: ClassVar[tuple[type[BaseException], ...]]
    """What the storage raises."""

    def __init__(self, folder: Path, ring: KeyRing, privacy: Privacy, clock: Callable[[], datetime]) -> None:
        """Nothing is written before there is something to remember.

        Args:
            folder: Where the profiles are; it need not be there yet.
            ring: Names the profiles.
            privacy: How long trips are kept, and whether new ones are.
            clock: Present time, with a time zone.
        """
        self._folder, self._ring, self._privacy, self._clock = folder, ring, privacy, clock

    @abstractmethod
    def _open(self, alias: str, person: PersonId | None = None) -> AbstractContextManager[StoredProfile | None]:
        """A profile, None where there is none of that alias; as of a person, or of whoever it says it is."""

    @abstractmethod
    def _made(self, person: PersonId) -> AbstractContextManager[StoredProfile]:
        """A person's profile, made now if there is none."""

    @abstractmethod
    def _aliases(self) -> Iterable[str]:
        """Aliases of which anything is on disk."""

    @abstractmethod
    def _destroy(self, aliases: Iterable[str]) -> bool:
        """Remove profiles for good, damaged ones too; False where there was nothing."""

    def recall(self, person: PersonId, instruction: Instruction, context: Context, k: int) -> History:
        """As `Memory.recall`; similarity is set on every item."""
        now, place = self._clock(), context.situation
        with self._reading(person) as profile:
            if profile is None:
                return History()
            wish, since = mark(instruction.text), self._privacy.since(now)
            with profile.reading(wish) as columns:
                found = nearest(columns, wish, place.world, weather_of(place), now, k, since=since)
                return History(profile.items(found))

    def latest(self, person: PersonId, world: str, k: int) -> History:
        """As `Memory.latest`."""
        with self._reading(person) as profile:
            if profile is None:
                return History()
            with profile.reading() as columns:
                rows = latest(columns, world, k, since=self._privacy.since(self._clock()))
                return History(profile.items([(row, UNCOMPARED) for row in rows]))

    def remember(self, trip: Trip, feedback: Feedback | None = None) -> None:
        """As `Memory.remember`; what is older than the retention goes."""
        person = trip.instruction.person
        if is_somebody(person) and self._privacy.keeps:
            now = self._clock()
            with self._made(person) as profile:
                profile.add(trip, feedback, stamp(now), self._privacy.keep_from(now))

    def attach_feedback(self, person: PersonId, feedback: Feedback, trip_id: str | None = None) -> bool:
        """As `Memory.attach_feedback`."""
        with self._reading(person) as profile:
            return profile is not None and profile.add_feedback(feedback, stamp(self._clock()), trip_id)

    def export(self, person: PersonId) -> str:
        """As `Memory.export`; every trip and every feedback carries its time."""
        with self._reading(person) as profile:
            trips = [] if profile is None else profile.export()
        document = {"format": self._format, "person": person, "exported": stamp(self._clock()), "trips": trips}
        return json.dumps(document, indent=2)

    def forget_last(self, person: PersonId) -> HistoryItem | None:
        """As `Memory.forget_last`."""
        with self._reading(person) as profile:
            return None if profile is None else profile.forget_last()

    def erase(self, person: PersonId) -> bool:
        """As `Memory.erase`, of damaged profiles too.

        Every profile that says it is this person's goes, also where it has another name: the salt that names are made
        with may have been lost, or replaced.

        Raises:
            ProfileError: It cannot be erased; or the salt is lost, and there are profiles that cannot be opened.
        """
        if not is_somebody(person) or not self._folder.exists():
            return False
        aliases, closed = self._aliases_of(person)
        try:
            aliases.add(self._ring.alias(person))
        except ProfileError as error:
            if not aliases and closed:
                raise ProfileError(
                    f"Whether anything is kept of {person!r} cannot be told: {error.message} And {len(closed)} "
                    f"profiles cannot be opened: {', '.join(closed)}.",
                    hint="Restore the salt, or the passphrase; or delete all files and folders of these names in "
                    f"{self._folder.parent}, whosever they are.",
                ) from error
        with self._errors(person):
            return self._destroy(aliases)

    def sweep(self) -> int:
        """As `Memory.sweep`."""
        keep_from = self._privacy.keep_from(self._clock())
        swept = 0
        for person in self.people() if keep_from else ():
            with self._reading(person) as profile:
                swept += 0 if profile is None else profile.forget_before(keep_from)
        return swept

    def people(self) -> tuple[PersonId, ...]:
        """As `Memory.people`; profiles that cannot be opened are logged and left out."""
        found: list[PersonId] = []
        for alias in self._aliases():
            try:
                with self._open(alias) as profile:
                    if profile is not None:
                        found.append(profile.person)
            except ProfileError as error:
                _log.warning("profile left out: %s", error)
        return tuple(sorted(found))

    def _aliases_of(self, person: PersonId) -> tuple[set[str], list[str]]:
        """Aliases of the profiles that say they are a person's, and of those that cannot be opened to say so."""
        found: set[str] = set()
        closed: list[str] = []
        for alias in self._aliases():
            try:
                with self._open(alias) as profile:
                    if profile is None:  # a key without a profile
                        closed.append(alias)
                    elif same_name(profile.person) == same_name(person):
                        found.add(alias)
            except ProfileError:
                closed.append(alias)
        return found, closed

    @contextmanager
    def _reading(self, person: PersonId) -> Generator[StoredProfile | None]:
        """The person's open profile, or None for nobody and for people of whom nothing is kept."""
        with self._errors(person):
            kept = is_somebody(person) and self._folder.exists()
        if not kept:
            yield None
            return
        with self._open(self._ring.alias(person), person) as profile:
            yield profile

    @contextmanager
    def _errors(self, person: str) -> Generator[None]:
        """Turn errors of the storage into ProfileError."""
        try:
            yield
        except (ProfileError, KeyboardInterrupt, SystemExit, GeneratorExit):
            raise
        except self._failures as error:
            raise ProfileError(
                f"The profile of {person!r} in {self._folder} cannot be used: {error}.",
                hint="If it is damaged or not a profile, restore it from a backup or erase it to start afresh; if the "
                "file is busy or the disk full, try again. Other profiles are not affected.",
                retryable=isinstance(error, OSError) or any(word in str(error) for word in ("locked", "full")),
            ) from error
