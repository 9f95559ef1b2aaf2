"""Hostile steering executors under the filter of streets, judged by polygons: a small run of the benchmark."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


def _script(name: str) -> ModuleType:
    """A benchmark's script as a module."""
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(name, BENCHMARKS / f"{name}.py")
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        spec.loader.exec_module(module)
    return sys.modules[name]


@pytest.fixture(scope="module")
def hostile() -> ModuleType:
    pytest.importorskip("shapely", reason="The judge unites lanes with shapely: pip install 'chauffeur[dev]'")
    module = _script("hostile_steering")
    module.LASTS_S.update({"town": 16.0, "open-road": 14.0})  # about half: a car stands, or has been wrong, by then
    return module


KINDS = ("lock", "sinusoid", "people", "oncoming", "kerb", "late", "random", "delayed", "throttle")


def _holds(row: dict[str, object]) -> bool:
    return row["fault"] != "ego" and row["off_m"] == 0.0 and not row["off_flag"]


@pytest.mark.parametrize("kind", KINDS)
def test_on_open_roads_nobody_is_struck_and_the_road_is_kept(hostile: ModuleType, kind: str) -> None:
    pytest.importorskip("vehiclemodels", reason="The open road needs CommonRoad's vehicle models: chauffeur[motion]")
    rows = [hostile.drive(hostile.Job(kind, "open-road", seed, True)) for seed in (4, 5)]
    assert all(map(_holds, rows)), rows
    assert sum(row["way_m"] for row in rows) > 10.0, "it drives"


@pytest.mark.parametrize("kind", KINDS)
def test_in_towns_nobody_is_struck_and_the_road_is_kept(hostile: ModuleType, kind: str) -> None:
    pytest.importorskip("libsumo", reason="Towns need SUMO: chauffeur[town]")
    row = hostile.drive(hostile.Job(kind, "town", 6 + KINDS.index(kind), True))
    assert _holds(row), row


def test_the_judge_sees_what_an_unfiltered_executor_does(hostile: ModuleType) -> None:
    pytest.importorskip("vehiclemodels", reason="The open road needs CommonRoad's vehicle models: chauffeur[motion]")
    kerb = hostile.drive(hostile.Job("kerb", "open-road", 4, False))
    assert kerb["off_m"] > 0.0
    oncoming = hostile.drive(hostile.Job("oncoming", "open-road", 4, False))
    assert oncoming["oncoming_s"] > 0.0


def test_gentle_trajectories_that_pass_the_check_end_on_the_road_and_their_own_side(hostile: ModuleType) -> None:
    pytest.importorskip("vehiclemodels", reason="The open road needs CommonRoad's vehicle models: chauffeur[motion]")
    del hostile
    gentle = _script("gentle_trajectories")
    found = [gentle.outcome(kind, "open-road", seed) for kind in gentle.KINDS for seed in (3, 4, 5)]
    passed = [one for one in found if not one.refused]
    assert len(passed) >= 5
    assert all(one.off_m <= 0.0 and one.oncoming_s == 0.0 for one in passed), passed
    kept = [one for one in found if one.kind == "keep"]
    assert not any(one.refused for one in kept), kept
    assert sum(bool(one.refused) and one.fits for one in found) <= 1, found
