"""What is recalled for a wish: same direction, same kind of road, same weather, lately; and the last word on it."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import pytest
from plain_ranking import Remembered, columns_of, remembered

from chauffeur.language.weather import DRY, FOG, RAIN, SNOW, UNKNOWN
from chauffeur.memory.columns import Signs
from chauffeur.memory.retrieval import nearest
from chauffeur.memory.similarity import mark

NOW = datetime(2026, 3, 1, tzinfo=UTC)
SLOWER: Signs = (-1, 0, 0)
FASTER: Signs = (1, 0, 0)


def entry(
    row: int, text: str, *, days: float = 1.0, world: str = "highway", weather: int = UNKNOWN, said: Signs | None = None
) -> Remembered:
    return remembered(row, text, NOW - timedelta(days=days), world, weather, said)


def rows(entries: list[Remembered], k: int = 2, text: str = "drive faster", weather: int = UNKNOWN) -> list[int]:
    return [row for row, _ in nearest(columns_of(entries), mark(text), "highway", weather, NOW, k)]


@pytest.mark.parametrize(
    ("wish", "opposites", "alike"),
    [
        ("Slow down", ["Drive faster", "Can you drive faster?", "hurry up", "speed up"], "take it slower, please"),
        ("Speed up", ["Slow down", "drive slower", "not so fast"], "I'm really in a hurry now"),
        ("Keep more distance", ["get closer to the car ahead", "reduce the gap"], "leave more room in front"),
        ("Get closer to the car ahead", ["keep more distance", "back off"], "reduce the gap"),
        ("Change to the left lane", ["change to the right lane"], "move over to the left"),
        ("Turn right", ["turn left", "go straight ahead", "do not turn right"], "take a right turn"),
        ("Overtake the truck", ["do not overtake the truck"], "get past this truck"),
        ("Pull over", ["do not pull over"], "stop here"),
        ("Drive more smoothly", ["drive more assertively"], "smoother please"),
    ],
)
def test_the_opposite_is_never_recalled_and_never_before_the_like(wish: str, opposites: list[str], alike: str) -> None:
    """Also where the opposite is of today, in the very words, judged, and the like is old and of another road."""
    entries = [entry(1, alike, days=80, world="intersection")]
    entries += [entry(row, text, days=0, said=FASTER) for row, text in enumerate(opposites, start=2)]
    assert rows(entries, 10, wish) == [1]


def test_the_nearer_number_comes_first() -> None:
    entries = [entry(1, "drive at 100 km/h"), entry(2, "drive at 60 km/h"), entry(3, "drive at 95 km/h")]
    assert rows(entries, 3, "drive at 97 km/h")[-1] == 2


def test_the_same_kind_of_road_comes_first() -> None:
    assert rows([entry(1, "drive faster", days=89), entry(2, "drive faster", world="intersection", days=0)]) == [1, 2]


@pytest.mark.parametrize("now", [RAIN, SNOW, FOG, RAIN | FOG, DRY])
def test_trips_in_the_same_weather_come_first(now: int) -> None:
    other = DRY if now != DRY else RAIN
    entries = [
        entry(1, "drive faster", days=89, weather=now),
        entry(2, "drive faster", days=0, weather=other),
        entry(3, "drive faster", days=0, weather=UNKNOWN),
    ]
    assert rows(entries, 3, weather=now) == [1, 3, 2]
    assert rows(entries, 3, weather=UNKNOWN) == [3, 2, 1], "where it is not known it does not count"


def test_the_recent_comes_first() -> None:
    assert rows([entry(1, "drive faster", days=1), entry(2, "drive faster", days=90)]) == [1, 2]
    assert rows([entry(1, "drive faster"), entry(2, "drive faster")]) == [2, 1]
    assert rows([entry(1, "drive faster", days=-5)]) == [1]


def test_meaning_counts_more_than_road_weather_and_recency_together() -> None:
    entries = [
        entry(1, "hurry up", days=89, world="intersection", weather=DRY),
        entry(2, "change to the left lane", days=0, weather=RAIN),
    ]
    assert rows(entries, 1, weather=RAIN) == [1]


def test_unrelated_and_opposite_wishes_are_left_out() -> None:
    assert rows([entry(1, "drive slower"), entry(2, "play some music")]) == []


def test_the_latest_verdict_is_always_among_the_chosen() -> None:
    entries = [entry(1, "drive faster"), entry(2, "drive faster"), entry(3, "please hurry up a bit", said=SLOWER)]
    assert rows(entries) == [2, 3]
    entries.append(entry(4, "drive faster", said=SLOWER))
    assert rows(entries) == [4, 2]


def test_the_other_side_of_a_conflict_is_among_the_chosen() -> None:
    entries = [entry(1, "hurry up", days=60, said=SLOWER)]
    entries += [entry(row, "drive faster", days=10 - row, said=FASTER) for row in range(2, 7)]
    assert rows(entries, 3) == [6, 5, 1]
    assert rows(entries, 2) == [6, 1]
    assert rows(entries, 1) == [6]
    entries[0] = entry(1, "hurry up", days=60, said=SLOWER, world="intersection")
    assert rows(entries, 3) == [6, 5, 4], "on another kind of road it was no contradiction"
    entries[0] = entry(1, "hurry up", days=60, said=(0, -1, 0))
    assert rows(entries, 3) == [6, 5, 4], "another topic is none either"


def test_nothing_asked_nothing_found() -> None:
    assert rows([], 3) == []
    assert rows([entry(1, "drive faster")], 0) == []
    assert rows([entry(1, "drive faster")], -1) == []


def test_similarity_stays_between_0_and_1() -> None:
    columns = columns_of([entry(1, "drive faster", days=0, weather=RAIN)])
    ((_, similarity),) = nearest(columns, mark("drive faster"), "highway", RAIN, NOW, 1)
    assert similarity == pytest.approx(1.0)
