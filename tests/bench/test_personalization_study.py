"""A sitting, its rows, and the figures."""

from __future__ import annotations

import json
from collections.abc import Sequence

import pytest

from chauffeur.bench.kernel.benchmark import ItemOutcome
from chauffeur.bench.kernel.conformance import faults
from chauffeur.bench.kernel.report import Line, fill
from chauffeur.bench.kernel.store import Row
from chauffeur.bench.personalization import figures
from chauffeur.bench.personalization.benchmark import StudyBenchmark, StudyConfig
from chauffeur.bench.personalization.study import ARMS, StudyJob

STUDY = StudyConfig(passengers=1, seed=5, half="tuning", trips=2)


@pytest.fixture(scope="module")
def sitting() -> Row:
    return StudyJob("p0001.go", 0, "go", STUDY).run()


def test_every_system_gets_the_same_words_scenes_and_moods_in_an_order_of_its_own(sitting: Row) -> None:
    measured = [trip for trip in sitting["trips"] if trip["phase"] == "measured"]
    orders = []
    for level in ("I", "II", "III"):
        block = [trip for trip in measured if trip["level"] == level]
        assert {trip["arm"] for trip in block} == set(ARMS)
        assert len({(trip["wish"], trip["scene"], trip["wanted_mps"]) for trip in block}) == 1
        assert [trip["place"] for trip in block] == list(range(1, len(ARMS) + 1))
        orders.append(tuple(trip["arm"] for trip in block))
    assert len(set(orders)) > 1


def test_memory_learns_in_the_trips_before_and_from_none_that_measures(sitting: Row) -> None:
    learning = [trip for trip in sitting["trips"] if trip["phase"] == "learning"]
    assert [trip["trip"] for trip in learning] == [1, 2]
    assert learning[0]["recalled"] == 0
    assert all(trip["feedback"] for trip in learning if trip["takeover"])
    assert all(trip.get("recalled", 0) <= 2 for trip in sitting["trips"])
    assert all(trip.get("recalled", 0) == 0 for trip in sitting["trips"] if trip["arm"] != "with")
    assert json.loads(json.dumps(sitting)) == sitting


def test_the_same_seed_gives_the_same_sitting(sitting: Row) -> None:
    again = StudyJob("p0001.go", 0, "go", STUDY).run()

    def timeless(row: Row) -> list[Row]:
        return [{name: value for name, value in trip.items() if name != "latency_s"} for trip in row["trips"]]

    assert timeless(again) == timeless(sitting)


def test_rows_say_that_nobody_was_asked(sitting: Row) -> None:
    bench = StudyBenchmark(STUDY)
    item = next(one for one in bench.items() if one.task == "go")
    rows = bench.rows(ItemOutcome(item, None, "", sitting))
    assert len(rows) == 2 + 3 * len(ARMS)
    assert all("simulated" in row["note"] for row in rows)
    assert figures.headline(rows).startswith("1 simulated passengers")


class _Quick(StudyBenchmark):
    """The quickest sittings alone."""

    def items(self) -> Sequence[StudyJob]:
        return [job for job in super().items() if job.task == "go"]


def test_it_conforms() -> None:
    assert faults(_Quick(StudyConfig(passengers=1, seed=5, half="tuning", trips=1))) == []


def _rows(persons: int, before: int, after: int) -> list[Row]:
    """Ten trips a person and system, of which so many are taken over."""
    return [
        {
            "passenger": f"p{person}", "task": "overtake", "ground": "highway", "level": "I", "trip": trip,
            "phase": "measured", "arm": arm, "takeover": trip < (before if arm == "keyword" else after),
            "topic": "too_fast",
        }
        for person in range(persons)
        for trip in range(10)
        for arm in ("keyword", "without")
    ]  # fmt: skip


def _table_ix(rows: list[Row]) -> list[Line]:
    return [line for line in fill(figures.TABLES[0], rows).lines if line.name == "highway I"]


def test_rates_and_reductions_are_those_of_the_rows() -> None:
    (found,) = _table_ix(_rows(12, 8, 2))
    assert found.items == 120
    assert [one.value for one in found.found] == pytest.approx([12.0, 0.8, 0.2, 0.75])
    (zero,) = _table_ix(_rows(12, 8, 0))
    assert zero.found[2].high == pytest.approx(0.2646, abs=1e-3)  # exact for 0 of 12 persons
    assert (zero.found[3].value, zero.found[3].low) == (1.0, None), "a reduction is no rate"
    (none,) = _table_ix(_rows(12, 0, 2))
    assert none.found[3].value is None


def test_trips_that_only_one_system_made_are_not_compared() -> None:
    rows = _rows(12, 8, 2)
    rows = [row for row in rows if row["arm"] == "keyword" or row["trip"] < 5]
    assert [line.items for line in _table_ix(rows)] == [60]
    assert _table_ix([row for row in rows if row["arm"] == "keyword"]) == []
