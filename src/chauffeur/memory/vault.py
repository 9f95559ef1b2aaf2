"""The default memory: one encrypted file per person, each under a random key of its own."""

from __future__ import annotations

import os
import threading
import time
import weakref
from collections.abc import Callable, Generator, Iterable
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Final

from chauffeur.concept import PersonId, ProfileError
from chauffeur.concept.data import data_home
from chauffeur.memory.cipher import DatabaseError
from chauffeur.memory.files import locked, private_directory, sync_directory
from chauffeur.memory.keys import KeyRing
from chauffeur.memory.privacy import Privacy, read_privacy, utc_now
from chauffeur.memory.profile import VERSION, Index, Profile, create_profile
from chauffeur.memory.profile_memory import ProfileMemory

_OPEN_PEOPLE: Final = 8
"""So many profiles stay open, those used last."""

_SETTLED_NS: Final = 100_000_000
"""File times are coarse: a file that changed less than this before it was looked at may have changed again unseen."""


@dataclass(slots=True)
class _Opened:
    """A profile that stays open.

    Attributes:
        path: Its file.
        profile: It.
        index: Its columns.
        key: What it was opened with.
        looks: Device, number, size and time of its file when it was last used; None where they tell nothing.
    """

    path: Path
    profile: Profile
    index: Index
    key: bytes
    looks: tuple[int, ...] | None

    def close(self) -> None:
        self.index.wipe()
        self.profile.close()


class VaultMemory(ProfileMemory):
    """Memory in encrypted files on this machine; safe for several processes and threads at once.

    Files stay open from one piece of work to the next, and each piece of work begins with a look at them: another
    process may write to a profile, replace it or erase it at any time.
    """

    encrypts = True
    _format = VERSION
    _failures = (DatabaseError, OSError)

    def __init__(
        self,
        home: Path | None = None,
        *,
        keys: Path | None = None,
        passphrase: str | None = None,
        privacy: Privacy | None = None,
        clock: Callable[[], datetime] = utc_now,
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
        profiles = root / "profiles"
        self._lock = profiles / "lock"
        self._keys = root / "keys" if keys is None else keys
        passphrase = os.environ.get("CHAUFFEUR_PASSPHRASE") if passphrase is None else passphrase
        ring = KeyRing(self._keys, passphrase, in_use=lambda: any(profiles.glob("*.db")))
        super().__init__(profiles, ring, read_privacy(root) if privacy is None else privacy, clock)
        self._guard = threading.RLock()
        self._opened: dict[str, _Opened] = {}
        self._process = os.getpid()
        weakref.finalize(self, _close_all, self._opened, self._process)

    def close(self) -> None:
        """Close all files and overwrite what was read of them; the next use opens them again."""
        with self._guard:
            _close_all(self._opened, self._process)

    def _aliases(self) -> list[str]:
        return sorted({path.stem for path in (*self._folder.glob("*.db"), *self._keys.glob("*.key"))})

    def _destroy(self, aliases: Iterable[str]) -> bool:
        """The key goes first, so nothing can be read from then on."""
        existed = False
        with self._guard, locked(self._lock, alone=True):
            for alias in aliases:
                self._shut(alias)
                existed |= self._ring.destroy(alias)
                for leftover in (*self._keys.glob(f"{alias}.*"), *self._folder.glob(f"{alias}.*")):
                    leftover.unlink(missing_ok=True)
                    existed = True
            sync_directory(self._keys)
            sync_directory(self._folder)
        return existed

    @contextmanager
    def _made(self, person: PersonId) -> Generator[Profile]:
        with self._guard:
            while True:
                self._ensure(person)
                with self._open(self._ring.alias(person), person) as profile:
                    if profile is not None:  # else another process erased it just now
                        yield profile
                        return

    def _ensure(self, person: PersonId) -> None:
        """Make the profile unless it is there. Key first: a profile without one is never on disk."""
        with self._errors(person):
            private_directory(self._folder)
            private_directory(self._keys)
            alias = self._ring.alias(person)
            path = self._path(alias)
            if path.exists():
                return
            with locked(self._lock, alone=True):
                if path.exists():
                    return
                for leftover in self._folder.glob(f"{alias}.*"):
                    leftover.unlink()
                draft = path.with_suffix(".draft")
                create_profile(draft, self._ring.find_or_make(alias), person)
                draft.chmod(0o600)
                draft.rename(path)
                sync_directory(self._folder)

    @contextmanager
    def _open(self, alias: str, person: PersonId | None = None) -> Generator[Profile | None]:
        name = alias if person is None else person
        with self._guard, self._errors(name), locked(self._lock, alone=False):
            self._leave_what_is_gone()
            # What is open still was just now seen to be there.
            if alias not in self._opened and not self._path(alias).exists():
                yield None
                return
            try:
                opened = self._current(alias, name)
                yield opened.profile
                opened.looks = _looks(opened.path)
            except BaseException:
                self._shut(alias)  # which undoes what was half done
                raise

    def _key(self, alias: str, person: str) -> bytes:
        key = self._ring.find(alias)
        if key is None:
            raise ProfileError(
                f"The profile of {person!r} has no key ({self._ring.path(alias)} is missing).",
                hint="Restore the key from a backup, or erase the profile to start afresh. "
                "Other profiles are not affected.",
            )
        return key

    def _current(self, alias: str, person: str) -> _Opened:
        """The profile as it is on disk: opened anew unless the file is the one this process used last."""
        key = self._key(alias, person)
        opened = self._opened.pop(alias, None)
        if opened is None or opened.key != key or opened.looks is None or opened.looks != _looks(opened.path):
            path, index = self._path(alias), Index() if opened is None else opened.index
            if opened is not None:
                opened.profile.close()
            try:
                opened = _Opened(path, Profile(path, key, index), index, key, None)
            except BaseException:
                index.wipe()
                raise
        self._opened[alias] = opened
        while len(self._opened) > _OPEN_PEOPLE:
            self._shut(next(iter(self._opened)))
        return opened

    def _leave_what_is_gone(self) -> None:
        """Close the profiles that another process erased; nothing that was read of them stays."""
        if os.getpid() != self._process:
            # An open database must not be used, nor closed, on this side of a fork.
            _inherited.extend(self._opened.values())
            self._opened.clear()
            self._process = os.getpid()
        for alias in [alias for alias, opened in self._opened.items() if not opened.path.exists()]:
            self._shut(alias)

    def _shut(self, alias: str) -> None:
        opened = self._opened.pop(alias, None)
        if opened is not None:
            opened.close()

    def _path(self, alias: str) -> Path:
        return self._folder / f"{alias}.db"


_inherited: list[_Opened] = []
"""Profiles that were open in the process this one was forked from."""


def _close_all(opened: dict[str, _Opened], process: int) -> None:
    while opened and os.getpid() == process:
        opened.popitem()[1].close()


def _looks(path: Path) -> tuple[int, ...] | None:
    """What tells that a file is still the same; None where it changed too recently to tell."""
    found = path.stat()
    if time.time_ns() - found.st_mtime_ns < _SETTLED_NS:
        return None
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns
