"""Memory in Chroma, by choice: `pip install 'chauffeur[chroma]'`, then the memory named `chroma`.

One directory per person, so that nobody's search sees another's rows. Chroma does not encrypt, and what it deletes
stays readable in its files (the text in the database, the vector in the index). So nothing is ever deleted in place:
what stays is written into a new directory, and the files of the old one are overwritten and removed. What Chroma has
written of its own memory besides is blanked. To recall, Chroma proposes the nearest wishes, and the same ranking as
everywhere chooses among them.
"""

from __future__ import annotations

import json
import math
import os
import secrets
import struct
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from datetime import datetime
from importlib import import_module
from pathlib import Path
from typing import Any, Final

import numpy as np

from chauffeur.concept import Feedback, HistoryItem, MissingExtraError, PersonId, Trip
from chauffeur.concept.data import data_home
from chauffeur.language.weather import weather_of
from chauffeur.memory.columns import Columns, Entry, packed
from chauffeur.memory.files import locked, private_directory, sync_directory
from chauffeur.memory.keys import KeyRing, same_name
from chauffeur.memory.privacy import Privacy, read_privacy, utc_now
from chauffeur.memory.profile_memory import ProfileMemory
from chauffeur.memory.records import MAX_CHARS, body_of, feedback_body, item_of
from chauffeur.memory.similarity import DIMENSIONS, MEANING_SHARE, TAGS, TEXT_SHARE, Mark, Vector, mark

FORMAT: Final = "chauffeur-chroma-1"

_COLLECTION: Final = "trips"
_PROPOSED: Final = 200
"""So many wishes Chroma proposes, and half as many of those with feedback."""

_BATCH: Final = 1_000
"""Rows read or written at a time: Chroma fails when it is asked for very many at once."""

_INDEX: Final = struct.Struct("<i4Q")
"""How `header.bin` of an index begins (hnswlib, `saveIndex`): version, offset, room, elements, bytes of each."""


class ChromaMemory(ProfileMemory):
    """Memory in Chroma's files on this machine, not encrypted; safe for several processes, one after another."""

    encrypts = False
    _format = FORMAT
    _failures = (BaseException,)  # Chroma names no family of errors, and its core panics past `Exception`

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
        ring = KeyRing(root / "chroma", in_use=lambda: bool(self._aliases()))
        super().__init__(root / "chroma", ring, read_privacy(root) if privacy is None else privacy, clock)

    def _aliases(self) -> list[str]:
        return sorted(one.name for one in self._folder.glob("*") if one.is_dir())

    @contextmanager
    def _open(self, alias: str, person: PersonId | None = None) -> Generator[_Profile | None]:
        with self._errors(alias if person is None else person), self._locked():
            folder = self._folder / alias
            yield None if _current(folder) is None else _Profile(self._chroma, folder, person)

    @contextmanager
    def _made(self, person: PersonId) -> Generator[_Profile]:
        with self._errors(person):
            private_directory(self._folder)
            with self._locked():
                yield _Profile(self._chroma, self._folder / self._ring.alias(person), person)

    def _destroy(self, aliases: Iterable[str]) -> bool:
        with self._locked():
            there = [folder for folder in map(self._folder.joinpath, aliases) if folder.exists()]
            for folder in there:
                _destroy(folder)
        return bool(there)

    def _locked(self) -> AbstractContextManager[None]:
        return locked(self._folder / "lock", alone=True)


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


class _Profile:
    """One person's folder. Rows are numbered from 0 without gaps, for nothing is deleted in place."""

    def __init__(self, chroma: Any, folder: Path, person: PersonId | None) -> None:
        """A profile that is opened for each piece of work.

        Args:
            chroma: The library.
            folder: Has the newest directory of the profile, and what a crash left behind; made if there is none.
            person: Whose it has to be; None for whoever it says.
        """
        self._chroma, self._folder, self._person = chroma, folder, person
        self._read: dict[int, _Row] = {}

    @property
    def person(self) -> PersonId:
        with self._collection() as collection:
            return _person_of(collection)

    @contextmanager
    def reading(self, wish: Mark | None = None) -> Generator[Columns]:
        """The trips that may bear on a wish: the nearest of all, and of those with feedback; or every trip."""
        with self._collection() as collection:
            self._read = dict(enumerate(_all(collection))) if wish is None else _proposed(collection, wish)
        columns = Columns()
        columns.extend([self._read[number].entry(number) for number in sorted(self._read)])
        yield columns

    def items(self, found: Sequence[tuple[int, float]]) -> tuple[HistoryItem, ...]:
        return tuple(self._read[row].item(similarity) for row, similarity in found)

    def export(self) -> list[dict[str, Any]]:
        with self._collection() as collection:
            return [row.exported() for row in _all(collection)]

    def add(self, trip: Trip, feedback: Feedback | None, when: str, keep_from: str) -> None:
        self.forget_before(keep_from)
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
        with self._collection() as collection:
            _put(collection, [_Row(_embedding(wish), body_of(trip), facts)])

    def add_feedback(self, feedback: Feedback, when: str, trip_id: str | None) -> bool:
        with self._collection() as collection:
            named = None if trip_id is None else {"trip": json.dumps(trip_id[:MAX_CHARS])}
            last = max((int(one) for one in collection.get(where=named, include=[])["ids"]), default=-1)
            if last < 0:
                return False
            facts = collection.get(ids=[str(last)], include=["metadatas"])["metadatas"][0]
            said = json.dumps([*json.loads(facts["feedback"]), _said(feedback, when)])
            collection.update(ids=[str(last)], metadatas=[{**facts, "judged": True, "feedback": said}])
            return True

    def forget_last(self) -> HistoryItem | None:
        with self._collection() as collection:
            rows = list(_all(collection))
        if not rows:
            return None
        self._rewrite(rows[:-1])
        return rows[-1].item()

    def forget_before(self, when: str) -> int:
        if not when or _current(self._folder) is None:
            return 0
        older = {"when_s": {"$lt": datetime.fromisoformat(when).timestamp()}}
        with self._collection() as collection:
            rows = list(_all(collection)) if collection.get(where=older, limit=1, include=[])["ids"] else []
        kept = [row for row in rows if row.at >= when]
        if len(kept) < len(rows):
            self._rewrite(kept)
        return len(rows) - len(kept)

    def _rewrite(self, rows: Sequence[_Row]) -> None:
        """Put a new directory with these rows alone in the place of the old one. A crash leaves the old or the new."""
        old = _current(self._folder)
        draft = self._folder / f"{secrets.token_hex(8)}.draft"
        with self._opened(private_directory(draft)) as collection:
            _put(collection, rows)
        for path in draft.rglob("*"):
            sync_directory(path)
        draft.rename(self._folder / f"{(0 if old is None else int(old.name)) + 1:08d}")
        sync_directory(self._folder)
        if old is not None:
            _destroy(old)

    @contextmanager
    def _collection(self) -> Generator[Any]:
        """The newest collection, made if there is none; what a crash left beside it goes."""
        current = _current(self._folder) or private_directory(self._folder) / f"{1:08d}"
        for other in self._folder.iterdir():
            if other != current:
                _destroy(other)
        with self._opened(private_directory(current)) as collection:
            yield collection

    @contextmanager
    def _opened(self, path: Path) -> Generator[Any]:
        new = not any(path.iterdir())
        settings = self._chroma.config.Settings(anonymized_telemetry=False)
        try:
            client: Any = self._chroma.PersistentClient(path=str(path), settings=settings)
        except BaseException:
            # Chroma keeps a system that did not start, and would hand it to whoever opens this path next.
            self._chroma.api.client.SharedSystemClient.clear_system_cache()
            raise
        try:
            if new and self._person is None:
                raise ValueError("it is empty")
            collection = _made(client, self._person) if new else _found(client)
            person = _person_of(collection)
            if self._person is not None and same_name(person) != same_name(self._person):
                raise ValueError("it is somebody else's")
            yield collection
        finally:
            client.close()
            _blank(path)


def _person_of(collection: Any) -> PersonId:
    return PersonId(json.loads(collection.metadata["person"]))


def _all(collection: Any) -> Iterator[_Row]:
    """Every trip, oldest first."""
    found: dict[int, _Row] = {}
    for start in range(0, collection.count(), _BATCH):
        found |= _rows(collection.get(limit=_BATCH, offset=start, include=_PARTS))
    return iter([found[number] for number in sorted(found)])


def _proposed(collection: Any, wish: Mark) -> dict[int, _Row]:
    """The nearest trips of all, and of those with feedback, by number."""
    count = collection.count()
    found: dict[int, _Row] = {}
    for asked in ({"n_results": _PROPOSED}, {"n_results": _PROPOSED // 2, "where": {"judged": True}}) if count else ():
        asked["n_results"] = min(count, asked["n_results"])
        near = collection.query(query_embeddings=[_embedding(wish)], include=_PARTS, **asked)
        found |= _rows({part: near[part][0] for part in ("ids", *_PARTS)})
    return found


def _put(collection: Any, rows: Sequence[_Row]) -> None:
    """Add trips behind those that are there."""
    first = collection.count()
    for start in range(0, len(rows), _BATCH):
        some = rows[start : start + _BATCH]
        collection.add(
            ids=[str(first + start + at) for at in range(len(some))],
            embeddings=[row.embedding for row in some],
            documents=[row.document for row in some],
            metadatas=[row.facts for row in some],
        )


_PARTS: Final = ["embeddings", "documents", "metadatas"]


def _rows(found: Any) -> dict[int, _Row]:
    parts = zip(found["ids"], *(found[part] for part in _PARTS), strict=True)
    return {int(number): _Row(list(embedding), document, dict(facts)) for number, embedding, document, facts in parts}


def _made(client: Any, person: PersonId | None) -> Any:
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
