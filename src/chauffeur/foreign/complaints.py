"""Complaints about answers from outside: bodies that are not read, and a server's own words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, cast

from chauffeur.concept import ChauffeurError

_DEPTH: Final = 5
_WORDS: Final = (
    "message", "msg", "detail", "error", "errors", "error_message", "error_description", "title", "reason", "metadata",
    "raw",
)  # fmt: skip
"""Fields in which servers say what is wrong: OpenAI's, FastAPI's (`detail`, a list of `msg` and `loc`), RFC 9457's."""


class ForeignBodyError(ChauffeurError):
    """A body that is not read: too long, or packed in a way that cannot be bounded."""


def server_words(found: object, depth: int = 0) -> str:
    """A server's own words for an error, out of any of the envelopes in use; empty if there are none."""
    if isinstance(found, str):
        return found.strip()
    if depth < _DEPTH and isinstance(found, list):
        said = [server_words(one, depth + 1) for one in cast("list[object]", found)[:3]]
        return "; ".join(one for one in said if one)
    if depth < _DEPTH and isinstance(found, Mapping):
        fields = cast("Mapping[str, Any]", found)
        words = next((said for name in _WORDS if (said := server_words(fields.get(name), depth + 1))), "")
        where: Any = fields.get("loc")
        place = ".".join(map(str, cast("list[object]", where))) if isinstance(where, list) else ""
        return f"{place}: {words}" if words and place else words
    return ""
