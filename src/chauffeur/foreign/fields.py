"""Objects that a model writes as JSON, and what it writes into a field that has nothing to say."""

from __future__ import annotations

import ast
import json
import re
from typing import Any, Final

from chauffeur.foreign.numbers import plain_signs

_OPENS: Final = re.compile(r"\{")
_MOST_TRIES: Final = 64
"""Openings that begin no object; each is read to where it goes wrong."""
_MOST_LITERAL: Final = 4_000
"""Characters of an object in Python's spelling."""
_TRAILING: Final = re.compile(r",(?=\s{0,80}[}\]])")
_NOTHING: Final = frozenset(
    {"n/a", "na", "n.a", "none", "no", "null", "nil", "nothing", "false", "empty", "undefined", "not applicable"}
    | {"not needed", "not required", "no refusal", "no refusal needed", "none needed", "no reason", "no need"}
    | {"nothing to refuse", "not refused", "not refusing", "i do not refuse", "not necessary"}
)
_NOTHING_FIRST: Final = re.compile(r"(?:n/?a|n\.a\.?|none|null|nil|not applicable|nothing)\s{0,3}(?:[.;:,(!-]|\Z)")
_PLACEHOLDER: Final = re.compile(r"[<\[{][^<>\[\]{}]{0,160}[>\]}]|[\W_]*")
"""`<the reason in one sentence>`, as the answer format has it, or no word at all."""


def says_nothing(value: object) -> bool:
    """True if a field is empty, or says in so many words that it is: `N/A`, `none`, `-`, null, a placeholder.

    "No lane is free" and "None of the lanes is free" say something.
    """
    if value is None or value is False:
        return True
    if not isinstance(value, str):
        return False
    text = " ".join(plain_signs(value).lower().split()).strip("\"'*_`")
    if _PLACEHOLDER.fullmatch(text):
        return True
    bare = text.strip(" .!-()[]{}<>")
    return not bare or bare in _NOTHING or _NOTHING_FIRST.match(text) is not None


def objects_in(text: str) -> list[dict[str, Any]]:
    """The objects that stand whole in a text, outermost ones, in order; in JSON, or else as Python or a hand writes it.

    Raises nothing; objects nested too deep are none.
    """
    found = _decoded(text)
    if found:
        return found
    plain = _TRAILING.sub("", plain_signs(text))
    return _decoded(plain) or _literal(plain)


def _decoded(text: str) -> list[dict[str, Any]]:
    decoder = json.JSONDecoder()
    found: list[dict[str, Any]] = []
    end = tries = 0
    for opening in _OPENS.finditer(text):
        if opening.start() < end:
            continue  # inside the one before
        try:
            value, end = decoder.raw_decode(text, opening.start())
        except ValueError:
            tries += 1
            if tries == _MOST_TRIES:
                break
            continue
        except RecursionError:
            break
        found.append(value)
    return found


def _literal(text: str) -> list[dict[str, Any]]:
    start, end = text.find("{"), text.rfind("}") + 1
    if not 0 <= start < end <= start + _MOST_LITERAL:
        return []
    try:
        value: Any = ast.literal_eval(text[start:end])
    except (SyntaxError, ValueError, TypeError, RecursionError, MemoryError):
        return []
    return [value] if isinstance(value, dict) and all(isinstance(name, str) for name in value) else []
