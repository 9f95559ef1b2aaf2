"""The study with people: a plan that is balanced and blind, a journal that loses nothing, and who withdraws is gone."""

from __future__ import annotations

import csv
import io
import os
from collections import Counter
from pathlib import Path

import pytest

from chauffeur.bench.personalization.people import PeopleStudy, csv_text, write_parquet
from chauffeur.bench.personalization.protocol import LEARNS, PEOPLE_ARMS, make_protocol
from chauffeur.concept import ConfigError, DataError


def test_orders_are_balanced_and_every_system_sees_every_block() -> None:
    protocol = make_protocol(12, 4, 5)
    orders: Counter[tuple[str, ...]] = Counter()
    for name in protocol.participants:
        blocks: dict[int, list[str]] = {}
        for trip in protocol.trips:
            if trip.participant == name and trip.phase == "measured":
                blocks.setdefault(trip.block, []).append(protocol.letters[name, trip.letter])
        assert len(blocks) == 9
        assert all(sorted(order) == sorted(PEOPLE_ARMS) for order in blocks.values())
        orders.update(tuple(order) for order in blocks.values())
    assert len(orders) == 6
    assert max(orders.values()) - min(orders.values()) <= 3
    cells = {(trip.ground, trip.level) for trip in protocol.trips if trip.phase == "measured"}
    assert len(cells) == 9


def test_the_plan_does_not_give_the_letters_away(tmp_path: Path) -> None:
    study = PeopleStudy.create(tmp_path / "lab", 6, 1, 2)
    plan = (tmp_path / "lab" / "plan.json").read_text(encoding="utf-8")
    assert "keyword" not in plan
    assert "seed" not in plan
    key = (tmp_path / "lab" / "key.sealed").read_bytes()
    assert b"keyword" not in key
    if os.name == "posix":
        assert (tmp_path / "lab" / "key.sealed").stat().st_mode & 0o077 == 0
    assert all(trip.letter == LEARNS for trip in study.trips_of("P001") if trip.phase == "learning")
    with pytest.raises(ConfigError, match="already"):
        PeopleStudy.create(tmp_path / "lab", 6, 1, 2)
    other = PeopleStudy.create(tmp_path / "other", 6, None, 2)
    assert len(other.participants) == 6


@pytest.fixture
def study(tmp_path: Path) -> PeopleStudy:
    made = PeopleStudy.create(tmp_path / "lab", 2, 1, 1)
    made.consent("P001")
    made.consent("P002")
    return made


def test_nothing_is_recorded_before_consent(tmp_path: Path) -> None:
    made = PeopleStudy.create(tmp_path / "lab", 2, 1, 1)
    with pytest.raises(ConfigError, match="consented"):
        made.record("P001", 1, takeover=True)
    assert made.rows() == []


def test_records_go_on_in_order_and_can_be_corrected(study: PeopleStudy) -> None:
    first = study.next_trip()
    assert first is not None
    assert (first.participant, first.number) == ("P001", 1)
    study.record("P001", 1, takeover=True, rating=2, at_s=4.5, comment="Too fast.")
    second = study.next_trip("P001")
    assert second is not None
    assert second.number == 2
    study.record("P001", 1, takeover=False, rating=6)
    assert [row["takeover"] for row in PeopleStudy(study.folder).rows()] == [False]
    journal = (study.folder / "records.jsonl").read_text(encoding="utf-8")
    assert journal.count('"P001.001"') == 2  # the first stays where it was


@pytest.mark.parametrize(
    "wrong",
    [
        {"number": 0},
        {"number": 999},
        {"participant": "P009"},
        {"rating": 8},
        {"rating": 0},
        {"at_s": -1.0},
        {"at_s": float("nan")},
        {"at_s": 3.0, "takeover": False},
        {"comment": "x" * 3000},
    ],
)
def test_what_cannot_be_is_not_recorded(study: PeopleStudy, wrong: dict[str, object]) -> None:
    given: dict[str, object] = {"participant": "P001", "number": 1, "takeover": True, **wrong}
    name, number = str(given.pop("participant")), int(str(given.pop("number")))
    with pytest.raises(ConfigError):
        study.record(name, number, **given)  # type: ignore[arg-type]
    assert study.rows() == []


def test_a_torn_line_costs_its_record_alone(study: PeopleStudy) -> None:
    for number in (1, 2):
        study.record("P001", number, takeover=True)
    path = study.folder / "records.jsonl"
    path.write_bytes(path.read_bytes()[:-20])
    left = PeopleStudy(study.folder)
    assert [row["number"] for row in left.rows()] == [1]
    left.record("P001", 2, takeover=False)
    assert [row["number"] for row in PeopleStudy(study.folder).rows()] == [1, 2]


def test_who_withdraws_is_gone_from_every_file_and_nothing_more_is_kept(study: PeopleStudy) -> None:
    study.record("P001", 1, takeover=True, comment="Unmistakable words.")
    study.record("P002", 1, takeover=False, comment="Others stay.")
    trips = study.trips_folder / "P001"
    trips.mkdir(parents=True)
    (trips / "001.mcap").write_bytes(b"Unmistakable words.")
    (study.folder / "results.jsonl").write_text("Unmistakable words.", encoding="utf-8")
    assert study.withdraw("P001") == 1
    content = b"".join(path.read_bytes() for path in study.folder.rglob("*") if path.is_file())
    assert b"Unmistakable" not in content
    assert b"Others stay." in content
    with pytest.raises(ConfigError, match="withdrawn"):
        study.record("P001", 1, takeover=True)
    following = PeopleStudy(study.folder).next_trip()
    assert following is not None
    assert following.participant == "P002"


def test_unblinding_waits_for_the_end_and_for_the_right_key(study: PeopleStudy) -> None:
    study.record("P001", 1, takeover=True)
    with pytest.raises(ConfigError, match="spoil"):
        study.unblinded()
    rows = study.unblinded(early=True)
    assert [row["arm"] for row in rows] == ["with"]
    assert b'"early":true' in (study.folder / "records.jsonl").read_bytes()
    (study.folder / "key.sealed").write_bytes(b"another")
    with pytest.raises(DataError, match="not the key"):
        study.unblinded(early=True)


def test_exports_stay_blind_and_are_harmless_in_a_spreadsheet(study: PeopleStudy, tmp_path: Path) -> None:
    study.record("P001", 1, takeover=True, rating=3, comment='=HYPERLINK("x"), "quoted"\nnew line')
    text = csv_text(study.rows())
    (row,) = csv.DictReader(io.StringIO(text))
    assert row["comment"].startswith("'=")
    assert row["letter"] == LEARNS
    assert "keyword" not in text
    parquet = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed")
    write_parquet(tmp_path / "x.parquet", study.rows())
    table = parquet.read_table(tmp_path / "x.parquet").to_pylist()
    assert table[0]["rating"] == 3
    assert table[0]["takeover"] is True


def test_a_folder_without_a_study_says_so(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="no study"):
        PeopleStudy(tmp_path)
    (tmp_path / "plan.json").write_text("[]", encoding="utf-8")
    with pytest.raises(DataError):
        PeopleStudy(tmp_path)
