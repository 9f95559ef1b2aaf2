"""The optional key of an audit log: who has it can write a log anew unseen, who has not cannot."""

from __future__ import annotations

import hashlib
import hmac
from pathlib import Path
from typing import Final

from chauffeur.concept import ConfigError

MIN_KEY_BYTES: Final = 16
MAX_KEY_BYTES: Final = 4096

_NAME_PURPOSE = b"chauffeur-audit-key-1\0"


def read_key(path: Path) -> bytes:
    """A key file's bytes, all of them.

    Raises:
        ConfigError: It cannot be read, or is too short to be a key.
    """
    try:
        with path.open("rb") as file:
            key = file.read(MAX_KEY_BYTES + 1)
    except OSError as error:
        raise ConfigError(
            f"The audit key {path} cannot be read: {error.strerror or error}.",
            hint="Make one with: head -c 32 /dev/urandom > audit.key",
        ) from error
    if not MIN_KEY_BYTES <= len(key) <= MAX_KEY_BYTES:
        raise ConfigError(
            f"The audit key {path} has {len(key)} bytes; {MIN_KEY_BYTES} to {MAX_KEY_BYTES} are expected.",
            hint="Make one with: head -c 32 /dev/urandom > audit.key",
        )
    return key


def sealed(key: bytes, purpose: bytes, content: bytes) -> str:
    """HMAC-SHA256 of a content under a key, for one purpose: what is sealed for another does not pass for it."""
    return hmac.new(key, purpose + content, hashlib.sha256).hexdigest()


def is_sealed(mac: str, key: bytes, purpose: bytes, content: bytes) -> bool:
    """True if a stated HMAC, which may be any text in a log that was tampered with, is that of a content."""
    return hmac.compare_digest(mac.encode(errors="surrogatepass"), sealed(key, purpose, content).encode())


def key_name(key: bytes) -> str:
    """A short name of a key by which a log says which one it was written with; nothing of the key can be read off."""
    return sealed(key, _NAME_PURPOSE, b"")[:16]
