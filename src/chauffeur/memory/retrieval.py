"""Which remembered wishes bear on the present one: by meaning, kind of world, weather and recency."""

from __future__ import annotations

from datetime import datetime
from typing import Final

import numpy as np

from chauffeur.memory.columns import Columns, Places
from chauffeur.memory.similarity import Mark
from chauffeur.memory.weather import UNKNOWN

LIKENESS, WORLD, RECENCY = 0.80, 0.12, 0.08
OTHER_WEATHER, UNKNOWN_WEATHER = 0.11, 0.09
"""Taken off where the present weather is known and that of the memory is another, or is not known. More than recency
and less than the kind of world: of two equal wishes, one in the same weather comes first, however old it is."""
HALF_LIFE_DAYS: Final = 30.0
FLOOR: Final = 0.2
"""Below this a memory has nothing to do with the wish; showing it would only mislead."""

UNCOMPARED: Final = -1.0
"""Similarity of what was recalled for another reason."""

_DAY_S: Final = 86_400.0


def nearest(
    columns: Columns,
    wish: Mark,
    world: str,
    weather: int,
    now: datetime,
    k: int,
    *,
    since: datetime | None = None,
) -> list[tuple[int, float]]:
    """Rows and similarities (0..1) of the `k` remembered wishes nearest to the present one, nearest first.

    The latest verdict on such wishes holds over older ones, so the newest one with feedback is always among them; and
    where an earlier verdict said the opposite in the same kind of world, the newest such one as well: both sides of a
    conflict are shown. These come last where they would not have been among the `k`.

    Args:
        columns: The remembered wishes.
        wish: The present one.
        world: World kind.
        weather: Bits of the weather.
        now: Present time.
        k: How many at most.
        since: Older ones do not count.
    """
    if not len(columns) or k <= 0:
        return []
    likeness = columns.likeness(wish)
    # Nothing below makes a wish more similar than it is like the present one.
    places = np.flatnonzero(likeness >= FLOOR)
    if since is not None:
        places = places[columns.whens[places] >= since.timestamp()]
    age_days = np.maximum(0.0, (now.timestamp() - columns.whens[places]) / _DAY_S)
    similarity = columns.by_world(lambda name: LIKENESS + WORLD * (name == world), places)
    similarity += RECENCY * np.exp2(-age_days / HALF_LIFE_DAYS)
    if weather != UNKNOWN:
        similarity -= columns.by_weather(lambda other: _weather_apart(weather, other), places)
    similarity *= likeness[places]
    fit = similarity >= FLOOR
    places, similarity = places[fit], similarity[fit]
    # Places are in the order of rows: of equally similar wishes the later one comes first.
    least = np.partition(similarity, -k)[-k] if len(places) > k else FLOOR
    best = np.flatnonzero(similarity >= least)
    best = best[np.lexsort((best, similarity[best]))[::-1]][:k]
    chosen: list[int] = best.tolist()
    wanted = _both_sides(columns, places)[:k]
    others = [one for one in chosen if one not in wanted][: k - len(wanted)]
    chosen = [one for one in chosen if one in wanted or one in others] + [one for one in wanted if one not in chosen]
    return [(int(columns.rows[places[one]]), float(similarity[one])) for one in chosen]


def latest(columns: Columns, world: str, k: int, *, since: datetime | None = None) -> list[int]:
    """Rows of the newest wishes with a verdict in a kind of world, newest first.

    Args:
        columns: The remembered wishes.
        world: World kind.
        k: How many at most.
        since: Older ones do not count.
    """
    places = np.flatnonzero(columns.judged)
    if not len(places) or k <= 0:
        return []
    if since is not None:
        places = places[columns.whens[places] >= since.timestamp()]
    places = places[columns.by_world(lambda name: float(name == world), places) > 0.0]
    return [int(row) for row in columns.rows[places[-k:][::-1]]]


def _both_sides(columns: Columns, places: Places) -> list[int]:
    """Which of some wishes has the newest verdict, and which the newest one before it that says the opposite of it."""
    judged = np.flatnonzero(columns.judged[places])
    if not len(judged):
        return []
    newest, earlier = int(judged[-1]), judged[:-1]
    opposite = np.zeros(len(earlier), np.bool_)
    for column in columns.signs:
        if column[places[newest]]:
            opposite |= column[places[earlier]] == -column[places[newest]]
    opposite &= columns.same_world(places[newest], places[earlier])
    against = earlier[opposite]
    return [newest, int(against[-1])] if len(against) else [newest]


def _weather_apart(weather: int, other: int) -> float:
    if other == UNKNOWN:
        return UNKNOWN_WEATHER
    return 0.0 if weather & other else OTHER_WEATHER
