"""A wish driven as parameters from end to end: planned, checked, driven, judged, replayed, refused."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from chauffeur.concept import ChauffeurError, Instruction, Limits, Parameters, Plan, PlanRequest, Thoughts
from chauffeur.driving import recording
from chauffeur.driving.again import drive_again
from chauffeur.driving.judge.choice import referee_for
from chauffeur.driving.recording import RecordedTrip, write_trip
from chauffeur.driving.scenarios import find
from chauffeur.driving.session import Session
from chauffeur.planners.base import Planner
from chauffeur.planners.registry import make_planner
from chauffeur.worlds.town.driver import TOWN_CAPABILITIES
from chauffeur.worlds.town.sumo import Sumo


@pytest.fixture(scope="module")
def planner() -> Planner:
    return make_planner("talk2drive")


def driven(planner: Planner, wish: str, name: str) -> RecordedTrip:
    scenario = find(name)
    session = Session(planner, referee=referee_for)
    return asyncio.run(session.drive(Instruction(wish), scenario, scenario.seed, Limits()))


def test_a_spoken_spot_is_parked_in_and_the_trip_replays(planner: Planner) -> None:
    recorded = driven(planner, "Park near the stadium.", "parking-stadium")
    assert recorded.trip.outcome == "success"
    assert isinstance(recorded.trip.plan.policy, Parameters)
    again = drive_again(recorded, Limits(), referee_for).trip
    assert again is not None and again.trip == recorded.trip
    assert again.frames == recorded.frames


def test_a_speed_is_driven_on_a_highway(planner: Planner) -> None:
    recorded = driven(planner, "Drive at 100 km/h.", "cruise")
    assert recorded.trip.outcome == "success"
    assert recorded.frames[-1].observation.ego.speed_mps == pytest.approx(27.8, abs=1.0)


def test_a_spot_that_is_not_there_is_refused_before_the_car_moves(planner: Planner) -> None:
    recorded = driven(planner, "Park in spot Z9.", "parking")
    assert recorded.trip.outcome == "refused"
    assert "Z9" in recorded.trip.causes.detail
    assert recorded.frames == ()


def test_a_turn_where_there_is_none_is_refused_by_the_checks(planner: Planner) -> None:
    recorded = driven(planner, "Turn left.", "cruise")
    assert recorded.trip.outcome == "refused"
    assert recorded.frames == ()


def test_a_way_in_a_town_is_done_when_it_is_taken(planner: Planner) -> None:
    pytest.importorskip("libsumo")
    recorded = driven(planner, "Turn left at the next light.", "town")
    assert recorded.trip.outcome == "success"
    assert recorded.final is not None
    assert recorded.final.time_s < 120.0


def test_a_stop_in_a_town_is_done_when_the_car_stands() -> None:
    pytest.importorskip("libsumo")
    recorded = driven(Standing(), "Wait here.", "town")
    assert recorded.trip.outcome == "success"
    assert recorded.final is not None
    assert recorded.final.ego.speed_mps < 0.1


def test_the_longest_drive_through_a_town_can_be_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("libsumo")
    recorded = driven(Standing(), "Wait here.", "town")
    of_all = len(recorded.frames) * 0.05 / TOWN_CAPABILITIES.horizon_s
    for bound in ("_MAX_VALUES", "_MAX_UNPACKED_BYTES", "_MAX_BYTES"):
        monkeypatch.setattr(recording, bound, int(getattr(recording, bound) * of_all))
    write_trip(tmp_path / "trip.mcap", recorded.trip, recorded.frames, recorded.scenario, final=recorded.final)


def test_an_engine_that_dies_on_the_way_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    libsumo = pytest.importorskip("libsumo")
    step = Sumo.step

    def dies(engine: Sumo) -> None:
        if libsumo.simulation.getTime() > 1.0:
            libsumo.close()
        step(engine)

    monkeypatch.setattr(Sumo, "step", dies)
    with pytest.raises(ChauffeurError, match="SUMO failed while it ran"):
        driven(Standing(), "Wait here.", "town")


class Standing:
    """A planner that stops, whatever is said."""

    id, model = "standing", ""

    async def plan(self, request: PlanRequest) -> Plan:
        del request
        return Plan(Thoughts("I stop."), Parameters(0.0, 12.0, 2.0, 0, ""), intent="stop", planner=self.id)
