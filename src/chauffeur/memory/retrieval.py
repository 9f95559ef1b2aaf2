"""Which remembered wishes bear on the present one: by meaning, kind of world, weather and recency."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import datetime
from typing import Final

import numpy as np

from chauffeur.language.weather import UNKNOWN
from chauffeur.memory.columns import Columns, Floats, Places
from chauffeur.memory.similarity import Mark

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
_ROUNDING: Final = 1e-9
"""No sum or product here is wrong by more than this part of it."""

_Similarity = Callable[[Places], Floats]
"""How similar the wishes at some places are."""

_LANES: Final = 256
_LOOKED_AT: Final = 1024
"""So many wishes are looked at first for the newest of a kind, which as a rule is among them."""


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
    if since is not None:
        np.putmask(likeness, columns.whens < since.timestamp(), 0.0)
    present = now.timestamp()
    worlds = columns.of_circumstances(lambda name, _: LIKENESS + WORLD * (name == world))
    weathers = columns.of_circumstances(lambda _, other: _weather_apart(weather, other))

    def similarity(places: Places) -> Floats:
        circumstances = columns.circumstances[places]
        age_days = np.maximum(0.0, (present - columns.whens[places]) / _DAY_S)
        found = RECENCY * np.exp2(age_days / -HALF_LIFE_DAYS)
        found += worlds[circumstances]
        found -= weathers[circumstances]
        found *= likeness[places]
        return found

    # Nothing above makes a wish more similar than it is like the present one, nor less than this part of it: what is
    # less like it than that part of the likeness of `k` others is not among the `k` most similar.
    least_part = (LIKENESS if weather == UNKNOWN else LIKENESS - OTHER_WEATHER) * (1.0 - _ROUNDING)
    places = np.flatnonzero(likeness >= max(FLOOR, least_part * _reached(likeness, k)))
    similar = similarity(places)
    near = np.flatnonzero(similar >= max(FLOOR, _reached(similar, k)))
    # Places are in the order of rows: of equally similar wishes the later one comes first.
    best = near[np.lexsort((near, similar[near]))[::-1]][:k]
    chosen: dict[int, float] = dict(zip(places[best].tolist(), similar[best].tolist(), strict=True))
    wanted = dict(_both_sides(columns, likeness, similarity)[:k])
    others = [one for one in chosen if one not in wanted][: k - len(wanted)]
    found = {one: value for one, value in chosen.items() if one in wanted or one in others} | wanted
    return [(int(columns.rows[place]), value) for place, value in found.items()]


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
    places = places[columns.of_circumstances(lambda name, _: name == world)[columns.circumstances[places]] > 0.0]
    return [int(row) for row in columns.rows[places[-k:][::-1]]]


def _reached(values: Floats, k: int) -> float:
    """What at least `k` of some values reach, and not many more; 0 where there are fewer."""
    lanes = max(_LANES, k)
    if len(values) >= 2 * lanes:
        values = values[: len(values) // lanes * lanes].reshape(-1, lanes).max(axis=0)
    return float(np.partition(values, -k)[-k]) if len(values) >= k else 0.0


def _both_sides(columns: Columns, likeness: Floats, similarity: _Similarity) -> list[tuple[int, float]]:
    """Of the wishes similar enough: which has the newest verdict, and which the newest one before it that says the
    opposite of it; each with its similarity.
    """
    found: list[tuple[int, float]] = []
    said, signs = columns.signs, [0, 0, 0]
    for places, similar in _verdicts(columns, likeness, similarity):
        if not found:
            found = [(int(places[-1]), float(similar[-1]))]
            signs = [int(column[places[-1]]) for column in said]
            if not any(signs):
                break
        opposite = np.zeros(len(places), np.bool_)
        for column, sign in zip(said, signs, strict=True):
            if sign:
                opposite |= column[places] == -sign
        opposite &= columns.same_world(found[0][0], places)
        against = np.flatnonzero(opposite)
        if len(against):
            return [*found, (int(places[against[-1]]), float(similar[against[-1]]))]
    return found


def _verdicts(columns: Columns, likeness: Floats, similarity: _Similarity) -> Iterator[tuple[Places, Floats]]:
    """The wishes with a verdict that are similar enough, and how similar: the newest part of them first."""
    end, length = len(likeness), _LOOKED_AT
    while end > 0:
        start = max(0, end - length)
        places = start + np.flatnonzero(columns.judged[start:end] & (likeness[start:end] >= FLOOR))
        similar = similarity(places)
        fit = similar >= FLOOR
        if fit.any():
            yield places[fit], similar[fit]
        end, length = start, 4 * length


def _weather_apart(weather: int, other: int) -> float:
    if weather == UNKNOWN:
        return 0.0
    if other == UNKNOWN:
        return UNKNOWN_WEATHER
    return 0.0 if weather & other else OTHER_WEATHER
