"""What the session has said, for whichever screen looks: a late one gets what still holds, a slow one no backlog."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncGenerator, Mapping
from dataclasses import replace
from typing import Any, Final

from chauffeur.concept import Lane, RoadGraph
from chauffeur.concept.units import SpeedUnit
from chauffeur.driving.talk.messages import Answered, Conversation, HeardWords, HowWasIt, Note, Road, Said, encode
from chauffeur.geometry import Polyline
from chauffeur.hmi.road import Bounds, as_json, draw_road, flat
from chauffeur.hmi.view import as_picture
from chauffeur.hmi.words import pace_of, passenger_units

_MARGIN_M = 20.0
_ON_FOOT = ("sidewalk", "crossing")


def in_unit(told: Conversation, unit: SpeedUnit) -> Conversation:
    """A conversation with the speeds that the car speaks of in the person's unit, whole."""
    why, thoughts, *said = (passenger_units(text, unit) for text in (told.why, told.thoughts, *told.said))
    verdicts = tuple(replace(one, reason=passenger_units(one.reason, unit)) for one in told.verdicts)
    return replace(told, why=why, thoughts=thoughts, said=tuple(said), verdicts=verdicts)


def drawn(road: Road) -> dict[str, Any]:
    """As a JSON object: the lanes as they were told, and the road as the pages' drawer takes it."""
    told = tuple(
        Lane(
            lane.id,
            Polyline.of(lane.centre_m),
            lane.width_m,
            0.0,
            kind="emergency" if lane.shoulder else lane.what,
            road=lane.road,
            index=lane.index,
            junction=lane.junction,
            street=lane.street,
        )
        for lane in road.lanes
    )
    graph, signs = as_picture(RoadGraph(told), road.signs)
    lanes = graph.lanes
    xs = [x for lane in lanes for x, _ in lane.centre.points_m]
    ys = [y for lane in lanes for _, y in lane.centre.points_m]
    everything = Bounds(min(xs, default=0.0), min(ys, default=0.0), max(xs, default=0.0), max(ys, default=0.0))
    return {
        "kind": road.kind,
        "world": road.world,
        "lanes": [
            {
                "id": lane.id,
                "p": flat(lane.centre.points_m),
                "w": lane.width_m,
                "road": lane.road,
                "i": lane.index,
                "e": lane.emergency,
            }
            for lane in lanes
            if lane.kind not in _ON_FOOT
        ],
    } | as_json(draw_road(graph, (), everything.grown(_MARGIN_M), signs))


MOST_WAITING: Final = 500
"""Messages that may wait for a screen; a slower one is let go, and begins anew."""
MOST_CONVERSATIONS: Final = 200
"""Of a session, that a late screen is shown; the books have all of them."""
_QUESTIONS: Final = ("heard", "how_was_it")
"""Kinds of message that ask the person something."""


class Outbox:
    """What waits for one screen. Kept by one event loop."""

    def __init__(self, backlog: Mapping[str, str]) -> None:
        self._waiting = dict(backlog)
        self._news = asyncio.Event()
        self._news.set()
        self._single = 0
        self._handing_on = False

    @property
    def full(self) -> bool:
        """Whether its screen has fallen too far behind."""
        return len(self._waiting) > MOST_WAITING

    @property
    def empty(self) -> bool:
        """Whether everything was handed on."""
        return not self._waiting and not self._handing_on

    def put(self, text: str, key: str = "") -> None:
        """Add a message after those that wait; an unread one with the same key is dropped. Without a key, none is."""
        self._waiting.pop(key, None)
        if not key:
            self._single += 1
            key = f"#{self._single}"
        self._waiting[key] = text
        self._news.set()

    async def follow(self) -> AsyncGenerator[str]:
        """Everything that waits, oldest first, and then whatever comes. Never ends by itself."""
        while True:
            await self._news.wait()
            while self._waiting:
                self._handing_on = True
                yield self._waiting.pop(next(iter(self._waiting)))
            self._handing_on = False
            self._news.clear()


class LatestMessages:
    """All that a screen has to be told which joins now."""

    def __init__(self) -> None:
        self._kept: dict[str, str] = {}
        self._conversations: dict[str, str] = {}
        self._unit: SpeedUnit = "km/h"

    def write(self, said: Said) -> tuple[str, str]:
        """Keep what will still hold when another screen joins.

        Returns:
            The message as JSON, and its key for `Outbox.put`; empty where each one counts.
        """
        match said:
            case Road():
                text = json.dumps(drawn(said))
            case Conversation():
                self._unit = pace_of(said.text, self._unit)
                text = json.dumps(json.loads(encode(in_unit(said, self._unit))) | {"unit": self._unit})
            case Note():
                text = encode(replace(said, text=passenger_units(said.text, self._unit))).decode()
            case _:
                text = encode(said).decode()
        match said:
            case Conversation(wish=wish):
                key = f"conversation {wish}"
                self._conversations[key] = text
                if len(self._conversations) > MOST_CONVERSATIONS:
                    del self._conversations[next(iter(self._conversations))]
                return text, key
            case Note():
                return text, ""
            case Answered(question=question):
                self._kept.pop(question, None)
                return text, ""
            case HeardWords(to_confirm=False):
                self._kept.pop(said.kind, None)
                return text, ""
            case HeardWords() | HowWasIt():
                self._kept[said.kind] = text
                return text, ""
            case _:
                self._kept[said.kind] = text
                return text, said.kind

    def backlog(self) -> dict[str, str]:
        """Key and message, in the order in which a screen wants them: questions come last."""
        first = {key: text for key, text in self._kept.items() if key not in _QUESTIONS}
        return first | self._conversations | self._kept
