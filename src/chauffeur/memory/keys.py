"""One random key per person, each in a file of its own; optionally sealed with a passphrase.

A profile is unreadable without its key, so deleting the key erases the profile even where old disk blocks survive.
Keys beside the data protect against a stolen copy of the profiles only; against a stolen disk, put the key directory on
another medium or set a passphrase.
"""

from __future__ import annotations

import hashlib
import hmac
import json
import os
import secrets
import unicodedata
from collections.abc import Callable
from pathlib import Path
from typing import Any

from chauffeur.concept import PersonId, ProfileError
from chauffeur.memory.files import NotPlainFileError, open_plain, publish, read_plain, write_new

KEY_BYTES = 32
_SCRYPT = {"n": 2**15, "r": 8, "p": 1}
"""About 0.1 s and 32 MB per guess of the passphrase."""

_SCRYPT_MEMORY = 64 * 1024 * 1024
_FORMAT = "chauffeur-key-1"


class KeyRing:
    """Keys of all people, in one directory."""

    def __init__(
        self, directory: Path, passphrase: str | None = None, *, in_use: Callable[[], bool] = lambda: False
    ) -> None:
        """A ring whose directory may not be there yet.

        Args:
            directory: Where the keys are, and the salt that people's aliases are made with.
            passphrase: Seals the keys; empty or None: they are not sealed.
            in_use: Whether there are profiles already. Then a lost salt is not replaced: nobody would be found again.
        """
        self._directory = directory
        self._in_use = in_use
        self._passphrase = passphrase or None
        self._salt: bytes | None = None
        self._opened: dict[str, tuple[bytes, bytes]] = {}

    def alias(self, person: PersonId) -> str:
        """File name for a person: a keyed hash, so that neither the name nor a guess of it can be read from it.

        Raises:
            ProfileError: The salt is lost or damaged.
        """
        name = same_name(person).encode("utf-8", "surrogatepass")
        return hashlib.blake2b(name, key=self._installation_salt(), digest_size=16).hexdigest()

    def path(self, alias: str) -> Path:
        """Where a person's key is kept."""
        return self._directory / f"{alias}.key"

    def find(self, alias: str) -> bytes | None:
        """A person's key; None where there is none.

        Raises:
            ProfileError: The key file is damaged, or the passphrase does not fit.
        """
        try:
            text = read_plain(self.path(alias))
        except FileNotFoundError:
            self._opened.pop(alias, None)
            return None
        except OSError as error:
            raise _bad(self.path(alias), f"cannot be read ({error.strerror})") from error
        # Opening a seal is slow on purpose; the file itself tells whether the key is still the one opened before.
        if alias not in self._opened or self._opened[alias][0] != text:
            key, sealed = self._unpack(text, self.path(alias))
            if self._passphrase is not None and not sealed:
                text = self._pack(key)
                publish(self.path(alias), text)
            self._opened[alias] = (text, key)
        return self._opened[alias][1]

    def find_or_make(self, alias: str) -> bytes:
        """A person's key, made now if there is none; it is on disk on return.

        Raises:
            ProfileError: As for `find`.
        """
        if (key := self.find(alias)) is None:
            write_new(self.path(alias), self._pack(secrets.token_bytes(KEY_BYTES)))
            key = self.find(alias)
        if key is None:
            raise _bad(self.path(alias), "disappeared while it was made")
        return key

    def destroy(self, alias: str) -> bool:
        """Overwrite and delete a key; False where there was none. Of a link, the link goes and nothing else."""
        self._opened.pop(alias, None)
        path = self.path(alias)
        try:
            with os.fdopen(open_plain(path, os.O_RDWR), "r+b") as file:
                file.write(secrets.token_bytes(max(1, os.fstat(file.fileno()).st_size)))
                file.flush()
                os.fsync(file.fileno())
        except FileNotFoundError:
            return False
        except NotPlainFileError:
            pass
        path.unlink()
        return True

    def _installation_salt(self) -> bytes:
        if self._salt is None:
            path = self._directory / "salt"
            salt = self._read_salt(path)
            if len(salt) != KEY_BYTES:
                raise _bad(path, f"has {len(salt)} bytes instead of {KEY_BYTES}")
            self._salt = salt
        return self._salt

    def _read_salt(self, path: Path) -> bytes:
        try:
            if not os.path.lexists(path):
                if self._in_use() or any(self._directory.glob("*.key")):
                    raise ProfileError(
                        f"{path} is missing, and without it no profile that is there is found by a person's name.",
                        hint="Restore it from a backup. To erase a profile needs none: chauffeur me erase --as NAME",
                    )
                write_new(path, secrets.token_bytes(KEY_BYTES))
            return read_plain(path)
        except OSError as error:
            raise _bad(path, f"cannot be read ({error.strerror})") from error

    def _pack(self, key: bytes) -> bytes:
        if self._passphrase is None:
            return json.dumps({"format": _FORMAT, "key": key.hex()}).encode()
        salt = secrets.token_bytes(16)
        pad, seal = _derive(self._passphrase, salt)
        # The pad is used once: its salt is fresh for every seal.
        body = bytes(a ^ b for a, b in zip(key, pad, strict=True))
        return json.dumps(
            {"format": _FORMAT, "salt": salt.hex(), "sealed": body.hex(), "mac": _mac(seal, salt + body).hex()}
        ).encode()

    def _unpack(self, text: bytes, path: Path) -> tuple[bytes, bool]:
        """The key, and whether it was sealed."""
        try:
            fields: dict[str, Any] = json.loads(text)
            if fields["format"] != _FORMAT:
                raise _bad(path, f"is of the unknown form {fields['format']!r}")
            if "key" in fields:
                key, sealed = bytes.fromhex(fields["key"]), False
            else:
                key, sealed = self._open_seal(fields, path), True
        except (ValueError, KeyError, TypeError) as error:
            raise _bad(path, "is damaged") from error
        if len(key) != KEY_BYTES:
            raise _bad(path, f"holds {len(key)} bytes instead of {KEY_BYTES}")
        return key, sealed

    def _open_seal(self, fields: dict[str, Any], path: Path) -> bytes:
        if self._passphrase is None:
            raise ProfileError(
                f"The key {path} is sealed with a passphrase.", hint="Set CHAUFFEUR_PASSPHRASE to open this profile."
            )
        salt, body = bytes.fromhex(fields["salt"]), bytes.fromhex(fields["sealed"])
        pad, seal = _derive(self._passphrase, salt)
        if not hmac.compare_digest(_mac(seal, salt + body), bytes.fromhex(fields["mac"])):
            raise ProfileError(
                f"The passphrase does not open the key {path}.",
                hint="Set CHAUFFEUR_PASSPHRASE to the passphrase this profile was made with.",
            )
        return bytes(a ^ b for a, b in zip(body, pad, strict=True))


def same_name(person: str) -> str:
    """A name as it is compared: one written form for what looks the same."""
    return unicodedata.normalize("NFC", person).strip()


def _derive(passphrase: str, salt: bytes) -> tuple[bytes, bytes]:
    both = hashlib.scrypt(
        passphrase.encode("utf-8", "surrogatepass"), salt=salt, maxmem=_SCRYPT_MEMORY, dklen=2 * KEY_BYTES, **_SCRYPT
    )
    return both[:KEY_BYTES], both[KEY_BYTES:]


def _mac(seal: bytes, message: bytes) -> bytes:
    return hmac.digest(seal, message, "sha256")


def _bad(path: Path, what: str) -> ProfileError:
    return ProfileError(
        f"The key file {path} {what}.",
        hint="Restore it from a backup; without it the profile it belongs to can only be erased. "
        "Other profiles are not affected.",
    )
