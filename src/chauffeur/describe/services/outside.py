"""Texts and numbers that services write. Texts may be hostile and numbers may be nonsense; neither gets past here."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from datetime import datetime
from functools import lru_cache
from typing import Any, Final, cast

from chauffeur.concept import DataError
from chauffeur.language.letters import clean
from chauffeur.safety.screening import MAX_CHARS, quote, screen

NAME_CHARS: Final = 60
"""Most characters of a name that go on."""

WITHHELD: Final = "(withheld: it does not read like a name)"


@lru_cache(maxsize=4096)
def quoted(text: str, limit: int = NAME_CHARS) -> str:
    """A text from outside as one short line between quotation marks; or, where something hides in it, WITHHELD.

    Unlike a wish, nobody is worse off without the name of a road, so nothing of a suspicious one is shown.
    """
    # Plain letters first: Japanese names have full-width digits, and what full-width words say is judged all the same.
    plain = clean(text[: MAX_CHARS + 1])
    if screen(plain, "service").withheld or screen(" ".join(plain.split()), "service").withheld:
        return WITHHELD
    return quote(plain, limit)


def decoded(body: bytes) -> Any:
    """The JSON value in a body.

    Raises:
        DataError: It is not JSON in UTF-8, or nested or long beyond reason.
    """
    try:
        return json.loads(body.decode("utf-8"), parse_constant=_no_number)
    except (ValueError, RecursionError) as error:  # bad UTF-8 is a ValueError, and so are numbers of 5000 digits
        raise DataError("the answer is not JSON") from error


def _no_number(name: str) -> float:
    raise ValueError(name)


def part(node: object, name: str) -> Mapping[str, Any]:
    """An object inside an object; empty where there is none."""
    inner = cast("Mapping[str, Any]", node).get(name) if isinstance(node, Mapping) else None
    return cast("Mapping[str, Any]", inner) if isinstance(inner, Mapping) else {}


def items(node: object, name: str) -> list[Any]:
    """A list inside an object; empty where there is none."""
    inner = cast("Mapping[str, Any]", node).get(name) if isinstance(node, Mapping) else None
    return cast("list[Any]", inner) if isinstance(inner, list) else []


def number(node: object, name: str, low: float, high: float) -> float | None:
    """A number inside an object; None where there is none, or one outside of what it could be."""
    value = cast("Mapping[str, Any]", node).get(name) if isinstance(node, Mapping) else None
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        found = float(value)
    except OverflowError:
        return None
    return found if math.isfinite(found) and low <= found <= high else None


def unix_time(said: object) -> float | None:
    """A time in ISO 8601 as Unix time; None where it is none."""
    try:
        return datetime.fromisoformat(said.replace("Z", "+00:00")).timestamp() if isinstance(said, str) else None
    except (ValueError, OverflowError):
        return None
