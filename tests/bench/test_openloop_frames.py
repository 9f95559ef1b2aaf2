"""Frames of our own: trips, what is kept of them, splits that share nothing, and nuScenes' format that comes out."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from chauffeur.bench.openloop.driving import COMMANDS, SEES_M, TOWNS, UNSEEN_TOWN, TrafficTrip, instants
from chauffeur.bench.openloop.extrapolation import FUTURE_KINDS, tells_nothing
from chauffeur.bench.openloop.frames import PERCEPTION, SHARES, SPLITS, FramesConfig, chosen, make_frames, trip_of
from chauffeur.bench.openloop.nuscenes import NuScenesTables
from chauffeur.concept import ConfigError


def test_splits_share_no_trip_and_the_test_town_is_in_no_other() -> None:
    config = FramesConfig()
    trips = {split: [trip_of(config, split, i) for i in range(config.count(split))] for split in SPLITS}
    seeds = [trip.seed for split in SPLITS for trip in trips[split]]
    assert len(set(seeds)) == len(seeds)
    assert {trip.town for trip in trips["test"]} == {UNSEEN_TOWN, ""}
    assert {trip.town for trip in trips["train"]} == {trip.town for trip in trips["val"]} == {*TOWNS, ""}
    assert {trip.place for trip in trips["train"]} == {"town", "highway", "crossing"}


def test_other_towns_are_driven_in_turn_but_never_the_test_splits() -> None:
    towns = tuple(f"town-{i}" for i in range(7))
    config = FramesConfig(trips=32, towns=towns)
    drawn = [trip_of(config, "train", i).town for i in range(32)]
    assert [one for one in drawn if one] == [towns[i % 7] for i in range(24)]
    for wrong in ((), ("Gridford", UNSEEN_TOWN)):
        with pytest.raises(ConfigError):
            FramesConfig(towns=wrong)


def test_of_each_kind_its_share_is_kept() -> None:
    assert sum(SHARES.values()) == pytest.approx(1.0) and set(SHARES) == set(FUTURE_KINDS)
    kinds = [None, *FUTURE_KINDS] * 40
    kept = chosen(kinds, 50, np.random.default_rng(0))
    assert kept == sorted(set(kept)) and None not in [kinds[i] for i in kept]
    for kind, share in SHARES.items():
        assert sum(kinds[i] == kind for i in kept) == round(share * 50)


def test_motion_that_has_begun_to_change_tells() -> None:
    steady = np.array([[-20, 0, 0], [-15, 0, 0], [-10, 0, 0], [-5, 0, 0], [0, 0, 0]], float)
    slower, turning = steady.copy(), steady.copy()
    slower[-1, 0] = -0.3
    turning[-1, 2] = 0.1
    assert tells_nothing(steady) and tells_nothing(np.zeros((5, 3)))
    assert not tells_nothing(slower) and not tells_nothing(turning)


def test_a_trip_over_the_crossing_is_the_same_every_time() -> None:
    trip = TrafficTrip("a", "crossing", "", 5, 8.0)
    moments, again = list(instants(trip)), list(instants(trip))
    assert len(moments) > 8
    assert [one.observation.ego for one in moments] == [one.observation.ego for one in again]
    assert {one.command for one in moments} < set(COMMANDS.values())
    assert all(0.0 <= one.lead_m <= SEES_M and 0.0 <= one.halt_m <= SEES_M for one in moments)
    times = [one.observation.time_s for one in moments]
    assert np.allclose(np.diff(times), 0.5)
    assert min(one.halt_m for one in moments) < 30.0  # it comes to the stop sign


def test_a_small_set_is_made_and_goes_on(tmp_path: Path) -> None:
    pytest.importorskip("libsumo")
    pytest.importorskip("PIL")
    config = FramesConfig(trips=8, seconds=14.0, most=12, width=64, height=32)
    told: list[tuple[int, int]] = []
    counts = make_frames(tmp_path, config, lambda done, of: told.append((done, of)), ("val",))
    assert told[-1] == (2, 2)
    tables = NuScenesTables(tmp_path, "v1.0-val")
    samples = tables.samples()
    assert len(samples) == sum(counts["val"].values()) > 0
    known = json.loads((tables.folder / PERCEPTION).read_text())
    for one in samples:
        assert one.picture.is_file() and one.whole and tells_nothing(one.history)
        assert one.kind in FUTURE_KINDS and one.command in COMMANDS.values() and one.place == "town"
        assert len(known[one.id]) == 4
    assert "Simulated" in (tmp_path / "CARD.md").read_text()
    records = {path: path.stat().st_mtime_ns for path in (tmp_path / "trips").iterdir()}
    assert make_frames(tmp_path, config, lambda done, of: None, ("val",)) == counts
    assert {path: path.stat().st_mtime_ns for path in records} == records  # nothing is driven twice
    with pytest.raises(ConfigError):
        make_frames(tmp_path, FramesConfig(trips=8, seed=1), lambda done, of: None, ("val",))
