"""The default memory: one encrypted file per person, each under a random key of its own."""

from __future__ import annotations

import json
import logging
import os
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path

from chauffeur.concept import (
    NOBODY,
    Context,
    Feedback,
    History,
    HistoryItem,
    Instruction,
    PersonId,
    ProfileError,
    Trip,
)
from chauffeur.memory.cipher import DatabaseError
from chauffeur.memory.files import data_home, locked, private_directory, sync_directory
from chauffeur.memory.keys import KeyRing
from chauffeur.memory.privacy import Privacy, read_privacy
from chauffeur.memory.profile import VERSION, Profile, create_profile, open_profile
from chauffeur.memory.retrieval import Entry, rank
from chauffeur.memory.similarity import mark

_log = logging.getLogger(__name__)
_CACHED_PEOPLE = 8


def _utc_now() -> datetime:
    return datetime.now(UTC)


class VaultMemory:
    """Memory in encrypted files on this machine; safe for several processes and threads at once.

    A file is open only while it is worked on, so another process may erase a profile at any time.
    """

    def __init__(
        self,
        home: Path | None = None,
        *,
        keys: Path | None = None,
        passphrase: str | None = None,
        privacy: Privacy | None = None,
        clock: Callable[[], datetime] = _utc_now,
    ) -> None:
        """Nothing is written before there is something to remember.

        Args:
            home: Data directory; CHAUFFEUR_HOME or the user's data directory by default.
            keys: Directory of the key files; `keys` in the data directory by default.
            passphrase: Seals the keys; CHAUFFEUR_PASSPHRASE by default, else they are not sealed.
            privacy: How long trips are kept, and whether new ones are; the data directory's own settings by default.
            clock: Present time, with a time zone.
        """
        root = data_home() if home is None else home
        self._profiles = root / "profiles"
        self._keys = root / "keys" if keys is None else keys
        self._ring = KeyRing(self._keys, os.environ.get("CHAUFFEUR_PASSPHRASE") if passphrase is None else passphrase)
        self._privacy = read_privacy(root) if privacy is None else privacy
        self._clock = clock
        self._guard = threading.RLock()
        self._indexes: dict[str, tuple[str, tuple[Entry, ...]]] = {}

    def recall(self, person: PersonId, instruction: Instruction, context: Context, k: int) -> History:
        """As `Memory.recall`; similarity is set on every item."""
        now = self._clock()
        with self._reading(person) as profile:
            if profile is None:
                return History()
            entries = self._entries(profile, person)
            nearest = rank(mark(instruction.text), context.situation.world, now, entries, k)
            return History(tuple(profile.item(row, similarity) for row, similarity in nearest))

    def remember(self, trip: Trip, feedback: Feedback | None = None) -> None:
        """As `Memory.remember`."""
        person = trip.instruction.person
        if not _is_somebody(person) or not self._privacy.keeps:
            return
        when, keep_from = _stamp(self._clock()), self._keep_from()
        with self._guard:
            while True:
                self._ensure(person)
                with self._reading(person) as profile:
                    if profile is not None:  # else another process erased it just now
                        profile.add(trip, feedback, when, keep_from)
                        return

    def attach_feedback(self, person: PersonId, feedback: Feedback, trip_id: str | None = None) -> bool:
        """As `Memory.attach_feedback`."""
        with self._reading(person) as profile:
            return profile is not None and profile.add_feedback(feedback, _stamp(self._clock()), trip_id)

    def export(self, person: PersonId) -> str:
        """As `Memory.export`; every trip and every feedback carries its time."""
        with self._reading(person) as profile:
            trips = [] if profile is None else profile.export()
        document = {"format": VERSION, "person": person, "exported": _stamp(self._clock()), "trips": trips}
        return json.dumps(document, indent=2)

    def forget_last(self, person: PersonId) -> HistoryItem | None:
        """As `Memory.forget_last`."""
        with self._reading(person) as profile:
            return None if profile is None else profile.forget_last()

    def erase(self, person: PersonId) -> bool:
        """As `Memory.erase`, of damaged profiles too: the key goes first, so nothing can be read from then on."""
        if not _is_somebody(person) or not self._profiles.exists():
            return False
        with self._guard, self._errors(person), locked(self._lock, alone=True):
            alias = self._ring.alias(person)
            self._indexes.pop(alias, None)
            existed = self._ring.destroy(alias)
            for leftover in (*self._keys.glob(f"{alias}.*"), *self._profiles.glob(f"{alias}.*")):
                leftover.unlink(missing_ok=True)
                existed = True
            sync_directory(self._keys)
            sync_directory(self._profiles)
        return existed

    def sweep(self) -> int:
        """Delete every trip that is older than the retention, of everybody; how many there were."""
        keep_from = self._keep_from()
        swept = 0
        for person in self.people() if keep_from else ():
            with self._reading(person) as profile:
                swept += 0 if profile is None else profile.forget_before(keep_from)
        return swept

    def people(self) -> tuple[PersonId, ...]:
        """As `Memory.people`; profiles that cannot be opened are logged and left out."""
        found: list[PersonId] = []
        for path in sorted(self._profiles.glob("*.db")):
            try:
                with self._open(path.stem, path.stem) as profile:
                    if profile is not None:
                        found.append(profile.person)
            except ProfileError as error:
                _log.warning("profile left out: %s", error)
        return tuple(sorted(found))

    @property
    def _lock(self) -> Path:
        return self._profiles / "lock"

    def _keep_from(self) -> str:
        retention = self._privacy.retention
        return "" if retention is None else _stamp(self._clock() - retention)

    def _entries(self, profile: Profile, person: PersonId) -> tuple[Entry, ...]:
        """The index of a profile, read again only after somebody wrote to it."""
        alias = self._ring.alias(person)
        edition, entries = self._indexes.pop(alias, ("", ()))
        if edition != profile.edition:
            entries = profile.entries()
        self._indexes[alias] = (profile.edition, entries)
        while len(self._indexes) > _CACHED_PEOPLE:
            del self._indexes[next(iter(self._indexes))]
        if self._privacy.retention is None:
            return entries
        keep_from = self._clock() - self._privacy.retention
        return tuple(entry for entry in entries if entry.when >= keep_from)

    def _ensure(self, person: PersonId) -> None:
        """Make the profile unless it is there. Key first: a profile without one is never on disk."""
        private_directory(self._profiles)
        private_directory(self._keys)
        with self._errors(person):
            alias = self._ring.alias(person)
            path = self._profiles / f"{alias}.db"
            if path.exists():
                return
            with locked(self._lock, alone=True):
                if path.exists():
                    return
                for leftover in self._profiles.glob(f"{alias}.*"):
                    leftover.unlink()
                draft = path.with_suffix(".draft")
                create_profile(draft, self._ring.find_or_make(alias), person)
                draft.chmod(0o600)
                draft.rename(path)
                sync_directory(self._profiles)

    @contextmanager
    def _reading(self, person: PersonId) -> Generator[Profile | None]:
        """The person's open profile, or None for nobody and for people of whom nothing is kept."""
        if not _is_somebody(person) or not self._profiles.exists():
            yield None
            return
        with self._open(self._ring.alias(person), person) as profile:
            yield profile

    @contextmanager
    def _open(self, alias: str, person: str) -> Generator[Profile | None]:
        with self._guard, self._errors(person), locked(self._lock, alone=False):
            path = self._profiles / f"{alias}.db"
            if not path.exists():
                yield None
                return
            key = self._ring.find(alias)
            if key is None:
                raise ProfileError(
                    f"The profile of {person!r} has no key ({self._ring.path(alias)} is missing).",
                    hint="Restore the key from a backup, or erase the profile to start afresh. "
                    "Other profiles are not affected.",
                )
            with open_profile(path, key) as profile:
                yield profile

    @contextmanager
    def _errors(self, person: str) -> Generator[None]:
        try:
            yield
        except (DatabaseError, OSError) as error:
            raise ProfileError(
                f"The profile of {person!r} in {self._profiles} cannot be used: {error}.",
                hint="If it is damaged or not a profile, restore it from a backup or erase it to start afresh; if the "
                "file is busy or the disk full, try again. Other profiles are not affected.",
                retryable=isinstance(error, OSError) or any(word in str(error) for word in ("locked", "full")),
            ) from error


def _is_somebody(person: PersonId) -> bool:
    return person.strip() != NOBODY


def _stamp(moment: datetime) -> str:
    """ISO 8601 in UTC and of fixed width, so that stamps sort as times."""
    return moment.astimezone(UTC).isoformat(timespec="milliseconds")
