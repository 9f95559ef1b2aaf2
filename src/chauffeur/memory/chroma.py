"""Memory in Chroma, by choice: `pip install 'chauffeur[chroma]'`, then the memory named `chroma`.

One directory per person, so that nobody's search sees another's rows. Chroma does not encrypt, and what it deletes
stays readable in its files (the text in the database, the vector in the index). So nothing is ever deleted in place:
what stays is written into a new directory, and the files of the old one are overwritten and removed. What Chroma has
written of its own memory besides is blanked. To recall, Chroma proposes the nearest wishes, and the same ranking as
everywhere chooses among them.
"""

from __future__ import annotations

import json
import logging
import math
import os
import secrets
import struct
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import datetime
from importlib import import_module
from pathlib import Path
from typing import Any, ClassVar, Final

import numpy as np

from chauffeur.concept import (
    Context,
    Feedback,
    History,
    HistoryItem,
    Instruction,
    MissingExtraError,
    PersonId,
    ProfileError,
    Trip,
)
from chauffeur.concept.data import data_home
from chauffeur.language.weather import weather_of
from chauffeur.memory.columns import Columns, Entry, packed
from chauffeur.memory.files import locked, private_directory, sync_directory
from chauffeur.memory.keys import KeyRing, same_name
from chauffeur.memory.privacy import Privacy, is_somebody, read_privacy, stamp, utc_now
from chauffeur.memory.records import MAX_CHARS, body_of, feedback_body, item_of
from chauffeur.memory.retrieval import UNCOMPARED, nearest
from chauffeur.memory.similarity import DIMENSIONS, MEANING_SHARE, TAGS, TEXT_SHARE, Mark, Vector, mark

FORMAT: Final = "chauffeur-chroma-1"

_COLLECTION: Final = "trips"
_PROPOSED: Final = 200
"""So many wishes Chroma proposes, and half as many of those with feedback."""

_BATCH: Final = 1_000
"""Rows read or written at a time: Chroma fails when it is asked for very many at once."""

_INDEX: Final = struct.Struct("<i4Q")
"""How `header.bin` of an index begins (hnswlib, `saveIndex`): version, offset, room, elements, bytes of each."""

_log = logging.getLogger(__name__)


class ChromaMemory:
    """Memory in Chroma's files on this machine, not encrypted; safe for several processes, one after another.

    Attributes:
        encrypts: As for `VaultMemory`.
    """

    encrypts: ClassVar = False

    def __init__(
        self, home: Path | None = None, *, privacy: Privacy | None = None, clock: Callable[[], datetime] = utc_now
    ) -> None:
        """Nothing is written before there is something to remember.

        Args:
            home: Data directory; CHAUFFEUR_HOME or the user's data directory by default.
            privacy: As for `VaultMemory`.
            clock: Present time, with a time zone.

        Raises:
            MissingExtraError: Chroma is not installed.
        """
        try:
            self._chroma: Any = import_module("chromadb")
        except ImportError as error:
            raise MissingExtraError("The memory 'chroma' needs Chroma.", extra="chroma") from error
        root = data_home() if home is None else home
        self._root = root / "chroma"
        self._names = KeyRing(self._root, in_use=lambda: any(one.is_dir() for one in self._root.glob("*")))
        self._privacy = read_privacy(root) if privacy is None else privacy
        self._clock = clock

    def recall(self, person: PersonId, instruction: Instruction, context: Context, k: int) -> History:
        """As `Memory.recall`, among the wishes that Chroma finds nearest."""
        now, wish, place = self._clock(), mark(instruction.text), context.situation
        since = self._privacy.since(now)
        with self._reading(person) as store:
            if store is None or k <= 0:
                return History()
            columns = Columns()
            columns.extend(store.proposed(wish))
            found = nearest(columns, wish, place.world, weather_of(place), now, k, since=since)
            return History(tuple(store.item(row, similarity) for row, similarity in found))

    def latest(self, person: PersonId, world: str, k: int) -> History:
        """As `Memory.latest`; it reads every trip."""
        keep_from = self._privacy.keep_from(self._clock())
        with self._reading(person) as store:
            if store is None or k <= 0:
                return History()
            judged = [row for row in store.rows() if row.feedback and row.at >= keep_from]
            items = [row.item(UNCOMPARED) for row in judged]
            return History(tuple([item for item in items if item.world == world][-k:][::-1]))

    def remember(self, trip: Trip, feedback: Feedback | None = None) -> None:
        """As `Memory.remember`; what is older than the retention goes."""
        person = trip.instruction.person
        if not is_somebody(person) or not self._privacy.keeps:
            return
        with self._errors(person):
            private_directory(self._root)
            with self._locked():
                folder, when = self._folder(person), stamp(self._clock())
                if not self._add(folder, trip, feedback, when):
                    self._leave_older(person, folder)
                    self._add(folder, trip, feedback, when)

    def attach_feedback(self, person: PersonId, feedback: Feedback, trip_id: str | None = None) -> bool:
        """As `Memory.attach_feedback`."""
        with self._reading(person) as store:
            return store is not None and store.add_feedback(feedback, stamp(self._clock()), trip_id)

    def export(self, person: PersonId) -> str:
        """As `Memory.export`."""
        with self._reading(person) as store:
            trips = [] if store is None else [row.exported() for row in store.rows()]
        document = {"format": FORMAT, "person": person, "exported": stamp(self._clock()), "trips": trips}
        return json.dumps(document, indent=2)

    def forget_last(self, person: PersonId) -> HistoryItem | None:
        """As `Memory.forget_last`: all other trips are written anew."""
        if not is_somebody(person) or not self._root.exists():
            return None
        with self._errors(person), self._locked():
            folder = self._folder(person)
            if _current(folder) is None:
                return None
            with self._store(folder, person) as store:
                rows = list(store.rows())
            if not rows:
                return None
            self._rewrite(folder, person, rows[:-1])
            return rows[-1].item()

    def erase(self, person: PersonId) -> bool:
        """As `Memory.erase`, of damaged profiles too; with the salt lost, of those that still say whose they are."""
        if not is_somebody(person) or not self._root.exists():
            return False
        with self._errors(person), self._locked():
            try:
                folders = [self._folder(person)]
            except ProfileError:
                folders = [folder for folder, name in self._names_said() if same_name(name) == same_name(person)]
                if not folders:
                    raise
            there = [folder for folder in folders if folder.exists()]
            for folder in there:
                _destroy(folder)
            return bool(there)

    def _names_said(self) -> Iterator[tuple[Path, PersonId]]:
        """Folders with the names that their profiles say, whether or not the folder's own name fits."""
        for folder in sorted(one for one in self._root.glob("*") if one.is_dir()):
            with suppress(ProfileError), self._errors(folder.name):
                current = _current(folder)
                if current is not None:
                    with self._opened(current, "", fits=False) as store:
                        yield folder, store.person

    def sweep(self) -> int:
        """Delete every trip that is older than the retention, of everybody; how many there were."""
        swept = 0
        for person in self.people():
            with self._errors(person), self._locked():
                swept += self._leave_older(person, self._folder(person))
        return swept

    def people(self) -> tuple[PersonId, ...]:
        """As `Memory.people`; profiles that cannot be opened are logged and left out."""
        found: list[PersonId] = []
        for folder in sorted(one for one in self._root.glob("*") if one.is_dir()):
            try:
                with self._errors(folder.name), self._locked():
                    current = _current(folder)
                    if current is not None:
                        with self._opened(current, "") as store:
                            found.append(store.person)
            except ProfileError as error:
                _log.warning("profile left out: %s", error)
        return tuple(sorted(found))

    def _folder(self, person: PersonId) -> Path:
        return self._root / self._names.alias(person)

    def _locked(self) -> Any:
        return locked(self._root / "lock", alone=True)

    def _add(self, folder: Path, trip: Trip, feedback: Feedback | None, when: str) -> bool:
        """Keep a trip, unless there are others first to be left behind."""
        keep_from = self._privacy.keep_from(self._clock())
        with self._store(folder, trip.instruction.person) as store:
            if keep_from and store.any_before(keep_from):
                return False
            store.add(trip, feedback, when)
            return True

    def _leave_older(self, person: PersonId, folder: Path) -> int:
        """Write a profile anew without the trips that are older than the retention; how many there were."""
        keep_from = self._privacy.keep_from(self._clock())
        if not keep_from or _current(folder) is None:
            return 0
        with self._store(folder, person) as store:
            rows = list(store.rows()) if store.any_before(keep_from) else []
        kept = [row for row in rows if row.at >= keep_from]
        if len(kept) < len(rows):
            self._rewrite(folder, person, kept)
        return len(rows) - len(kept)

    def _rewrite(self, folder: Path, person: PersonId, rows: Sequence[_Row]) -> None:
        """A new directory with these rows alone takes the place of the old one. A crash leaves the old or the new."""
        old = _current(folder)
        draft = folder / f"{secrets.token_hex(8)}.draft"
        with self._opened(private_directory(draft), person) as store:
            store.put(rows)
        for path in draft.rglob("*"):
            descriptor = os.open(path, os.O_RDONLY)
            try:
                os.fsync(descriptor)
            finally:
                os.close(descriptor)
        draft.rename(folder / f"{_number(old) + 1:08d}")
        sync_directory(folder)
        if old is not None:
            _destroy(old)

    @contextmanager
    def _reading(self, person: PersonId) -> Generator[_Store | None]:
        if not is_somebody(person) or not self._root.exists():
            yield None
            return
        with self._errors(person), self._locked():
            folder = self._folder(person)
            if _current(folder) is None:
                yield None
                return
            with self._store(folder, person) as store:
                yield store

    @contextmanager
    def _store(self, folder: Path, person: str) -> Generator[_Store]:
        """The newest directory of a profile, made if there is none; what a crash left beside it goes."""
        current = _current(folder) or private_directory(folder) / f"{1:08d}"
        for other in folder.iterdir():
            if other != current:
                _destroy(other)
        with self._opened(private_directory(current), person) as store:
            yield store

    @contextmanager
    def _opened(self, path: Path, person: str, *, fits: bool = True) -> Generator[_Store]:
        new = not any(path.iterdir())
        settings = self._chroma.config.Settings(anonymized_telemetry=False)
        client: Any = self._chroma.PersistentClient(path=str(path), settings=settings)
        try:
            store = _Store(_made(client, person) if new else _found(client))
            if fits and self._names.alias(store.person) != path.parent.name:
                raise ValueError("it is somebody else's")
            yield store
        finally:
            client.close()
            _blank(path)

    @contextmanager
    def _errors(self, person: str) -> Generator[None]:
        try:
            yield
        except (ProfileError, KeyboardInterrupt, SystemExit, GeneratorExit):
            raise
        except BaseException as error:  # Chroma names no family of errors, and its core panics past `Exception`
            raise ProfileError(
                f"The profile of {person!r} in {self._root} cannot be used: {error}.",
                hint="If it is damaged or not a profile, restore it from a backup or erase it to start afresh. "
                "Other profiles are not affected.",
                retryable=isinstance(error, OSError),
            ) from error


@dataclass(frozen=True, slots=True)
class _Row:
    """One trip as Chroma keeps it: numbers and words to choose by, and the whole as a document."""

    embedding: Sequence[float]
    document: str
    facts: dict[str, Any]

    @property
    def at(self) -> str:
        return str(self.facts["at"])

    @property
    def feedback(self) -> list[dict[str, Any]]:
        return json.loads(self.facts["feedback"])

    def entry(self, row: int) -> Entry:
        said = self.feedback
        signs = [next((one[topic] for one in said[::-1] if one[topic]), 0) for topic in ("speed", "gap", "comfort")]
        return Entry(
            row,
            packed(np.asarray(self.embedding[:DIMENSIONS], np.float32)),
            int(self.facts["tags"]),
            tuple((str(name), float(value)) for name, value in json.loads(self.facts["quantities"])),
            str(self.facts["world"]),
            int(self.facts["weather"]),
            datetime.fromisoformat(self.at),
            (signs[0], signs[1], signs[2]) if said else None,
        )

    def item(self, similarity: float = 0.0) -> HistoryItem:
        said = tuple(json.dumps(one) for one in self.feedback)
        facts = self.facts
        return item_of(json.loads(facts["trip"]), self.at, str(facts["world"]), self.document, said, similarity)

    def exported(self) -> dict[str, Any]:
        facts = self.facts
        trip = {"trip": json.loads(facts["trip"]), "when": self.at, "world": facts["world"]}
        return {**trip, **json.loads(self.document), "feedback": self.feedback}


class _Store:
    """One person's collection. Rows are numbered from 0 without gaps, for nothing is deleted in place."""

    def __init__(self, collection: Any) -> None:
        self._collection = collection
        self._proposed: dict[int, _Row] = {}

    @property
    def person(self) -> PersonId:
        return PersonId(json.loads(self._collection.metadata["person"]))

    def rows(self) -> Iterator[_Row]:
        """Every trip, oldest first."""
        found: dict[int, _Row] = {}
        for start in range(0, self._collection.count(), _BATCH):
            found |= _rows(self._collection.get(limit=_BATCH, offset=start, include=_PARTS))
        return iter([found[number] for number in sorted(found)])

    def proposed(self, wish: Mark) -> list[Entry]:
        """The trips that may bear on a wish, oldest first: the nearest of all, and of those with feedback."""
        count = self._collection.count()
        if not count:
            return []
        near: dict[str, Any] = {"query_embeddings": [_embedding(wish)], "include": _PARTS}
        for asked in (
            {"n_results": min(count, _PROPOSED)},
            {"n_results": min(count, _PROPOSED // 2), "where": {"judged": True}},
        ):
            found = self._collection.query(**near, **asked)
            self._proposed |= _rows({part: found[part][0] for part in ("ids", *_PARTS)})
        return [self._proposed[number].entry(number) for number in sorted(self._proposed)]

    def item(self, number: int, similarity: float) -> HistoryItem:
        """One of the proposed trips."""
        return self._proposed[number].item(similarity)

    def any_before(self, stamp: str) -> bool:
        """Whether there are older trips than that."""
        when = datetime.fromisoformat(stamp).timestamp()
        return bool(self._collection.get(where={"when_s": {"$lt": when}}, limit=1, include=[])["ids"])

    def add(self, trip: Trip, feedback: Feedback | None, when: str) -> None:
        """Keep a trip."""
        wish, situation = mark(trip.instruction.text), trip.context.situation
        facts = {
            "trip": json.dumps(trip.id[:MAX_CHARS]),
            "at": when,
            "when_s": datetime.fromisoformat(when).timestamp(),
            "world": situation.world.encode("utf-8", "replace").decode(),
            "weather": weather_of(situation),
            "tags": wish.tags,
            "quantities": json.dumps(wish.quantities),
            "judged": feedback is not None,
            "feedback": json.dumps([] if feedback is None else [_said(feedback, when)]),
        }
        self.put([_Row(_embedding(wish), body_of(trip), facts)])

    def put(self, rows: Sequence[_Row]) -> None:
        """Keep trips as they are."""
        first = self._collection.count()
        for start in range(0, len(rows), _BATCH):
            some = rows[start : start + _BATCH]
            self._collection.add(
                ids=[str(first + start + at) for at in range(len(some))],
                embeddings=[row.embedding for row in some],
                documents=[row.document for row in some],
                metadatas=[row.facts for row in some],
            )

    def add_feedback(self, feedback: Feedback, when: str, trip_id: str | None) -> bool:
        """Add feedback to the last trip, or to the last one with this id; False where there is none."""
        if trip_id is None:
            numbers = [self._collection.count() - 1]
        else:
            named = {"trip": json.dumps(trip_id[:MAX_CHARS])}
            numbers = [int(one) for one in self._collection.get(where=named, include=[])["ids"]]
        last = max(numbers, default=-1)
        if last < 0:
            return False
        facts = self._collection.get(ids=[str(last)], include=["metadatas"])["metadatas"][0]
        said = json.dumps([*json.loads(facts["feedback"]), _said(feedback, when)])
        self._collection.update(ids=[str(last)], metadatas=[{**facts, "judged": True, "feedback": said}])
        return True


_PARTS: Final = ["embeddings", "documents", "metadatas"]


def _rows(found: Any) -> dict[int, _Row]:
    parts = zip(found["ids"], *(found[part] for part in _PARTS), strict=True)
    return {int(number): _Row(list(embedding), document, dict(facts)) for number, embedding, document, facts in parts}


def _made(client: Any, person: str) -> Any:
    about = {"format": FORMAT, "person": json.dumps(person)}
    space = {"hnsw": {"space": "cosine"}}
    return client.create_collection(_COLLECTION, embedding_function=None, metadata=about, configuration=space)


def _found(client: Any) -> Any:
    collection = client.get_collection(_COLLECTION, embedding_function=None)
    if collection.metadata["format"] != FORMAT:
        raise ValueError(f"unknown version {collection.metadata['format']!r}")
    return collection


def _embedding(wish: Mark) -> list[float]:
    """The text and the tags in one vector, so that Chroma's cosine comes near to what the ranking says."""
    tags = np.array([1.0 if wish.tags >> bit & 1 else 0.0 for bit in range(len(TAGS))])
    tags *= math.sqrt(MEANING_SHARE / TEXT_SHARE) / max(1.0, math.sqrt(tags.sum()))
    some = [1e-3]  # a wish without words has a direction as well
    whole: Vector = np.concatenate([wish.vector, tags, some]).astype(np.float32)
    return whole.tolist()


def _said(feedback: Feedback, when: str) -> dict[str, Any]:
    return {"when": when, **json.loads(feedback_body(feedback))}


def _current(folder: Path) -> Path | None:
    """The newest complete directory of a profile."""
    return max((one for one in folder.glob("*") if one.name.isdecimal()), default=None)


def _number(current: Path | None) -> int:
    return 0 if current is None else int(current.name)


def _blank(path: Path) -> None:
    """Blank the unused part of the index: Chroma makes it by writing out memory that it never cleared, in which words
    of anybody may stand.

    Raises:
        ValueError: The index is not of the form this was written for.
    """
    for header in path.glob("*/header.bin"):
        content = header.read_bytes()
        version, _, _, used, size = _INDEX.unpack_from(content) if len(content) >= _INDEX.size else (0,) * 5
        if version != 1 or not size:
            raise ValueError(f"{header.name} is of a form that is not known")
        for name, each in (("data_level0.bin", size), ("length.bin", 4)):
            with (header.parent / name).open("r+b") as file:
                free = file.seek(0, os.SEEK_END) - used * each
                if free > 0:
                    file.seek(used * each)
                    file.write(bytes(free))
                    file.flush()
                    os.fsync(file.fileno())


def _destroy(folder: Path) -> None:
    """Overwrite and remove a directory, as far as the disk writes in place."""
    for path in sorted(folder.rglob("*"), reverse=True):
        if path.is_dir():
            path.rmdir()
            continue
        with path.open("r+b") as file:
            file.write(secrets.token_bytes(path.stat().st_size))
            file.flush()
            os.fsync(file.fileno())
        path.unlink()
    folder.rmdir()
    sync_directory(folder.parent)
