"""Personal texts of a record: stored beside the chained body, digested in it, and erasable without breaking the chain.

The body refers to a text as `{"digest": SHA-256(salt + form + value)}`; the value and its random salt stand in the
record's `texts`. Erasing a text erases its salt as well, so that not even a guess of the words can be tried on what is
left. In privacy mode the value is the text's HMAC under the log's key instead of the text; without a key there is
neither text nor digest: a digest of a short wish that anybody can compute would give the wish away.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal

from chauffeur.safety.audit.entries import AuditRecord
from chauffeur.safety.audit.findings import TEXT_CODES, TextCode
from chauffeur.safety.audit.keys import is_sealed, sealed

SALT_BYTES: Final = 16

REFERENCES: Final = "texts"
"""Name in the body under which the digests stand."""

Form = Literal["text", "hmac"]

_HMAC_PURPOSE = b"chauffeur-audit-text-1\0"
_ERASED: dict[str, Any] = {"redacted": True}
_WITHHELD: dict[str, Any] = {"withheld": True}


@dataclass(frozen=True, slots=True)
class TextState:
    """State of one personal text of a record.

    Attributes:
        name: Its name.
        state: `stored`, `digest` (privacy mode with a key), `withheld` (without one), `redacted`, or what is wrong.
        words: The text where it is stored; else empty.
    """

    name: str
    state: Literal["stored", "digest", "withheld", "redacted"] | TextCode
    words: str = ""


def hide(
    texts: Mapping[str, str], *, private: bool, key: bytes | None, make_salt: Callable[[int], bytes]
) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
    """Texts as (references for the body, values to stand beside it).

    Args:
        texts: The texts by name.
        private: Whether nothing of the words may be kept.
        key: The log's key, if it has one.
        make_salt: Gives that many random bytes, fit for cryptography.
    """
    references: dict[str, Any] = {}
    values: dict[str, dict[str, Any]] = {}
    for name, text in texts.items():
        if private and key is None:
            references[name] = _WITHHELD
            continue
        salt = make_salt(SALT_BYTES)
        form: Form = "hmac" if private else "text"
        value = text
        if private and key is not None:
            value = sealed(key, _HMAC_PURPOSE, salt + text.encode(errors="surrogatepass"))
        references[name] = {"digest": _digest(salt, form, value)}
        values[name] = {"salt": salt.hex(), form: value}
    return references, values


def states(record: AuditRecord) -> Iterator[TextState]:
    """Yield the state of each personal text of a record, tampering included."""
    references = _references(record)
    for name in record.texts:
        if name not in references:
            yield TextState(name, "text_added")
    for name, reference in references.items():
        yield _state(name, reference, record.texts.get(name))


def words_of(record: AuditRecord) -> dict[str, str]:
    """The personal texts of a record as they can be shown: the words, or in brackets why there are none."""
    wrong = dict.fromkeys(TEXT_CODES, "[does not fit its digest]")
    marks = {"digest": "[digest only]", "withheld": "[withheld]", "redacted": "[redacted]", **wrong}
    return {state.name: marks.get(state.state, state.words) for state in states(record)}


def says(record: AuditRecord, name: str, text: str, key: bytes | None = None) -> bool | None:
    """True if a record's text was this one; None where that cannot be known (redacted, withheld, no key given)."""
    value = record.texts.get(name)
    if value is None or _is_erased(value) or _state(name, _references(record).get(name), value).state in TEXT_CODES:
        return None
    if "text" in value:
        return value["text"] == text
    if key is None:
        return None
    salt = bytes.fromhex(str(value["salt"]))
    return is_sealed(str(value["hmac"]), key, _HMAC_PURPOSE, salt + text.encode(errors="surrogatepass"))


def erased(record: AuditRecord) -> dict[str, dict[str, Any]]:
    """Texts of a record once all of them are erased."""
    return {name: dict(_ERASED) for name in record.texts}


def _state(name: str, reference: Any, value: Mapping[str, Any] | None) -> TextState:
    if reference == _WITHHELD:
        return TextState(name, "text_added") if value else TextState(name, "withheld")
    if value is None:
        return TextState(name, "text_removed")
    if _is_erased(value):
        return TextState(name, "redacted")
    form: Form = "hmac" if "hmac" in value else "text"
    if set(value) == {"salt", form} and all(isinstance(part, str) for part in value.values()):
        words = str(value[form])
        try:
            salt = bytes.fromhex(str(value["salt"]))
        except ValueError:
            salt = b""
        if salt.hex() == value["salt"] and reference == {"digest": _digest(salt, form, words)}:
            return TextState(name, "stored", words) if form == "text" else TextState(name, "digest")
    return TextState(name, "text_changed")


def _is_erased(value: Mapping[str, Any]) -> bool:
    return len(value) == 1 and value.get("redacted") is True  # by identity: to Python, 1 equals true


def _references(record: AuditRecord) -> dict[str, Any]:
    # Anything may stand there in a log that somebody has rewritten.
    listed: dict[str, Any] | None = record.body.get(REFERENCES)
    return listed if isinstance(listed, dict) else {}


def _digest(salt: bytes, form: Form, value: str) -> str:
    return hashlib.sha256(salt + form.encode() + b"\0" + value.encode(errors="surrogatepass")).hexdigest()
