"""A policy repository: programs that did well, kept in a folder that can be shared, inspected, merged and pruned.

The folder holds one file of JSON lines, one program each. Whatever in it cannot be believed (see `policies_entry`) is
set aside with its reason and never used; the rest works. Programs of the same name are told apart by a version:
`overtake`, `overtakeV2`, ...
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from chauffeur.concept import DataError, ProgramError
from chauffeur.memory.files import publish
from chauffeur.memory.policies_entry import MAX_DESCRIPTION_CHARS, Judge, PolicyEntry, write_entry
from chauffeur.memory.policies_file import (
    FILE,
    MAX_ENTRIES,
    Rejected,
    append_lines,
    as_data_error,
    read_line,
    read_policies,
    writing,
)
from chauffeur.memory.similarity import Mark, encode, likeness, mark

CRITIC_LABELS: dict[Judge, str] = {"person": "critic: person", "evaluator": "critic: evaluator (not a person)"}
"""What has to stand wherever a result is shown that rests on such a judgement."""

_MEANING, _COMMAND, _DESCRIPTION = 0.65, 0.25, 0.10
"""Weights of meaning, and of the words alone: the program for the opposite wish is still a pattern to write after."""
_OTHER_ROAD = 0.3


@dataclass(frozen=True, slots=True)
class Recalled:
    """A program that bears on a wish, and how near it is (0..1)."""

    entry: PolicyEntry
    similarity: float


@dataclass(frozen=True, slots=True)
class Merged:
    """What a merge did: entries added, entries that were there already, and what was not believed."""

    added: tuple[PolicyEntry, ...]
    known: int
    rejected: tuple[Rejected, ...]


class PolicyRepository:
    """The programs of one folder. Several processes may add to it; each sees the others' additions when it adds."""

    def __init__(self, folder: Path, *, create: bool = False) -> None:
        """Open a repository.

        Args:
            folder: Its folder.
            create: Make an empty one where there is none.

        Raises:
            DataError: There is none, or its file is not one that can be read safely.
        """
        self.folder = folder
        self._path = folder / FILE
        self._marks: dict[str, tuple[Mark, Mark]] = {}
        if create:
            try:
                folder.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise DataError(f"The repository {folder} cannot be made: {error.strerror}.") from error
        elif not self._path.is_file():
            raise DataError(
                f"{folder} is no policy repository: it holds no {FILE}.",
                hint="Make one with `chauffeur bench coach --repository FOLDER`, or import one.",
            )
        self.entries: tuple[PolicyEntry, ...] = ()
        self.rejected: tuple[Rejected, ...] = ()
        self._load()

    @property
    def digest(self) -> str:
        """Hash of what the repository offers: names, descriptions and programs. It pins a frozen repository."""
        parts = sorted(f"{e.id}\0{e.callable_name}\0{e.description}" for e in self.entries)
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()

    @property
    def labels(self) -> tuple[str, ...]:
        """What must be said wherever a result of these programs is shown."""
        return critic_labels(self.entries)

    def find(self, key: str) -> PolicyEntry:
        """An entry by its name as programs call it, or by the beginning of its id.

        Raises:
            DataError: None, or several.
        """
        named = [entry for entry in self.entries if entry.callable_name == key]
        found = named or [entry for entry in self.entries if len(key) >= 4 and entry.id.startswith(key)]
        if len(found) != 1:
            what = "no program" if not found else "several programs"
            raise DataError(
                f"{self.folder} holds {what} {key!r}.", hint=f"List them: chauffeur show policies {self.folder}"
            )
        return found[0]

    def recall(self, command: str, world: str, k: int = 3, *, critique: str = "") -> tuple[Recalled, ...]:
        """The programs nearest to a wish, nearest first.

        What the wish asks for (direction, manoeuvre, numbers) is read from the wish alone; a critique adds its words.
        Of programs learned for the same words on the same kind of road only the newest counts.

        Args:
            command: The wish.
            world: Kind of road.
            k: How many at most.
            critique: What was said of the last attempt.
        """
        entries = _newest(self.entries)
        if not entries or k <= 0:
            return ()
        wish = mark(command)
        if critique:
            wish = replace(wish, vector=encode(f"{command} {critique}"))
        marks = [self._marks_of(entry) for entry in entries]
        commands = np.stack([one.vector for one, _ in marks]) @ wish.vector
        told = np.stack([one.vector for _, one in marks]) @ wish.vector
        likes = likeness(wish, commands, (one for one, _ in marks))
        scored: list[Recalled] = []
        for entry, like, near, said in zip(entries, likes, commands.tolist(), told.tolist(), strict=True):
            score = _MEANING * like + _COMMAND * max(0.0, near) + _DESCRIPTION * max(0.0, said)
            scored.append(Recalled(entry, score * (1.0 if entry.world == world else _OTHER_ROAD)))
        scored.sort(key=lambda one: (-one.similarity, one.entry.callable_name))
        return tuple(scored[:k])

    def commit(self, entry: PolicyEntry) -> PolicyEntry:
        """Add an entry, as the next version of its name; returns it as kept, or the same one kept before.

        Raises:
            ProgramError: Its program may not be offered.
            DataError: The repository is full, or its file cannot be written.
        """
        merged = self.merge([entry])
        if merged.rejected:
            raise ProgramError(f"The program {entry.name} is not kept. {merged.rejected[0].reason}")
        return next(one for one in self.entries if one.id == entry.id)

    def merge(self, entries: Iterable[PolicyEntry], *, received: str = "") -> Merged:
        """Add other entries; those whose id is there already are passed over.

        Args:
            entries: What to add, e.g. of another repository; its order counts where names collide.
            received: Where they come from, kept with each.

        Raises:
            DataError: The repository would be too full, or its file cannot be written.
        """
        added: list[PolicyEntry] = []
        rejected: list[Rejected] = []
        known = 0
        with writing(self.folder, self._load):
            names = {entry.callable_name for entry in self.entries}
            ids = {entry.id for entry in self.entries}
            for number, entry in enumerate(entries, start=1):
                if entry.id in ids:
                    known += 1
                    continue
                new = _versioned(replace(entry, received=(received or entry.received)[:300]), names)
                believed = read_line(write_entry(new))  # what could not be read again is not written either
                if isinstance(believed, str):
                    rejected.append(Rejected(number, f"{entry.callable_name}: {believed}"))
                    continue
                added.append(new)
                names.add(new.callable_name)
                ids.add(new.id)
            if len(ids) > MAX_ENTRIES:
                raise DataError(
                    f"{self.folder} would hold {len(ids)} programs; {MAX_ENTRIES} are the most.",
                    hint="Prune it first: chauffeur model policies prune",
                )
            append_lines(self._path, b"".join(write_entry(entry) for entry in added))
            self.entries = (*self.entries, *added)
        return Merged(tuple(added), known, tuple(rejected))

    def describe(self, entry: PolicyEntry, description: str) -> PolicyEntry:
        """Give an entry a person's own description. Raises DataError when it is empty or too long."""
        words = " ".join(description.split())
        if not words or len(words) > MAX_DESCRIPTION_CHARS:
            raise DataError(f"A description has 1 to {MAX_DESCRIPTION_CHARS} characters, not {len(words)}.")
        new = replace(entry, description=words, described_by="person")
        self._rewrite(lambda kept: [new if one.id == entry.id else one for one in kept])
        return new

    def prune(self, ids: Collection[str], *, drop_rejected: bool = False) -> int:
        """Take entries out, and on demand the lines that are not believed; returns how many entries went."""
        before = len(self.entries)
        self._rewrite(lambda kept: [one for one in kept if one.id not in ids], drop_rejected=drop_rejected)
        return before - len(self.entries)

    def export(self, path: Path, entries: Sequence[PolicyEntry]) -> None:
        """Write entries to one file that `read_policies` and any repository can read.

        Raises:
            DataError: The file cannot be written.
        """
        with as_data_error(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            publish(path, b"".join(write_entry(entry) for entry in entries))

    def _marks_of(self, entry: PolicyEntry) -> tuple[Mark, Mark]:
        key = f"{entry.id}\0{entry.description}"
        if key not in self._marks:
            self._marks[key] = mark(entry.command), mark(entry.description)
        return self._marks[key]

    def _load(self) -> None:
        if self._path.exists() or self._path.is_symlink():
            self.entries, self.rejected = read_policies(self._path)

    def _rewrite(
        self, change: Callable[[Sequence[PolicyEntry]], list[PolicyEntry]], *, drop_rejected: bool = False
    ) -> None:
        with writing(self.folder, self._load):
            entries = change(self.entries)
            rejected = () if drop_rejected else self.rejected
            lines = [one.raw.rstrip(b"\n") + b"\n" for one in rejected if one.raw]
            with as_data_error(self._path):
                publish(self._path, b"".join([*(write_entry(entry) for entry in entries), *lines]))
            self._load()


def critic_labels(entries: Iterable[PolicyEntry]) -> tuple[str, ...]:
    """Who judged these programs, in words; an evaluator is never passed over in silence."""
    judges = [entry.judged_by for entry in entries]
    if not judges:
        return ()
    machine = judges.count("evaluator")
    if 0 < machine < len(judges):
        return (f"{CRITIC_LABELS['evaluator']} for {machine} of {len(judges)} programs",)
    return (CRITIC_LABELS["evaluator" if machine else "person"],)


def superseded(entries: Sequence[PolicyEntry]) -> tuple[PolicyEntry, ...]:
    """Entries learned for the same words on the same kind of road as a newer one: `recall` passes them over."""
    kept = {entry.id for entry in _newest(entries)}
    return tuple(entry for entry in entries if entry.id not in kept)


def _newest(entries: Sequence[PolicyEntry]) -> list[PolicyEntry]:
    """Of each wish on each kind of road the entry that was added last."""
    latest = {(" ".join(entry.command.split()).casefold(), entry.world): entry for entry in entries}
    return list(latest.values())


def _versioned(entry: PolicyEntry, taken: Collection[str]) -> PolicyEntry:
    version = 1
    while replace(entry, version=version).callable_name in taken:
        version += 1
    return replace(entry, version=version)
