"""What the page may say. Anything else is refused: the connection is closed, and the drive goes on without it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, Literal

from chauffeur.concept import DataError
from chauffeur.hmi.wheel.controls import ALL_KEYS, Keys

MAX_MESSAGE_BYTES = 256

Verb = Literal["keys", "start", "pause", "go", "give_up", "next"]
_VERBS = ("keys", "start", "pause", "go", "give_up", "next")


@dataclass(frozen=True, slots=True)
class PageMessage:
    """One message of the page.

    Attributes:
        verb: What it is about.
        keys: Driving keys held, with `keys`.
        number: The page's own count of its `keys` messages.
        item: Item that `start`, `next` and `give_up` are about: a word said late cannot hit the item after it.
    """

    verb: Verb
    keys: Keys = Keys.NONE
    number: int = 0
    item: str = ""


def parse(message: str | bytes) -> PageMessage:
    """Read a message of the page.

    Raises:
        DataError: It is not one.
    """
    try:
        raw: Any = json.loads(message)
        verb, keys, number, item = raw["t"], raw.get("k", 0), raw.get("n", 0), raw.get("item", "")
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise DataError("The page said something that is not a message.") from error
    if verb not in _VERBS or type(keys) is not int or type(number) is not int or not isinstance(item, str):
        raise DataError(f"The page said an unknown word: {verb!r}.")
    if not 0 <= keys <= int(ALL_KEYS) or not 0 <= number < 2**53:
        raise DataError(f"The page said keys {keys!r}, number {number!r}.")
    return PageMessage(verb, Keys(keys), number, item)
