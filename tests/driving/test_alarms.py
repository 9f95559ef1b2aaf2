"""What a planner understands as a call to stop or as distress reaches the car's own emergency answer."""

from __future__ import annotations

import asyncio
import time

import pytest

from chauffeur.concept import NOBODY, Alarm, Limits, Plan, PlanRequest, Program, Thoughts
from chauffeur.driving.emergency import EMERGENCY_PLANNER, QUESTION, STOPPING
from chauffeur.driving.live.settings import Settings
from chauffeur.driving.live.starts import Start
from chauffeur.driving.live.supervisor import Runtime
from chauffeur.driving.onroad.session import VehicleSession
from chauffeur.driving.recording import RecordedTrip
from chauffeur.driving.scenarios import find
from chauffeur.driving.session import Session, parse_wish
from chauffeur.language.emergency import read_emergency
from chauffeur.planners.base import Planner
from chauffeur.planners.registry import make_planner
from chauffeur.worlds.ros.factory import open_vehicle
from chauffeur.worlds.ros.settings import parse_settings

CALL = "come to rest now"
"""Read as a stop by planners, and by none of the emergency words."""
STANDING_PROGRAM = "def halt():\n    set_target_speed(0.0)\n    while True:\n        yield autopilot()\n"
WITHIN_S = 120.0


class Answers:
    """A planner that gives one plan."""

    id, model = "answers", "none"

    def __init__(self, plan: Plan) -> None:
        self._plan = plan

    async def plan(self, request: PlanRequest) -> Plan:
        del request
        return self._plan


def refuses(alarm: Alarm = "", *, words: str = "No.", intent: str = "declined") -> Answers:
    return Answers(Plan(Thoughts(words), None, words, intent=intent, alarm=alarm))


def drive(text: str, planner: Planner, scenario: str = "overtake") -> RecordedTrip:
    place = find(scenario)
    session = Session(planner=planner, max_s=15.0)
    return asyncio.run(session.drive(parse_wish(text, NOBODY), place, place.seed, Limits()))


@pytest.mark.parametrize("planner", [refuses("stop"), Answers(Plan(Thoughts("I stop."), Program(STANDING_PROGRAM)))])
def test_a_stop_that_a_planner_would_not_or_may_not_drive_is_the_cars_own(planner: Planner) -> None:
    recorded = drive("Change to the left lane.", planner)
    assert (recorded.trip.plan.planner, recorded.trip.plan.alarm) == (EMERGENCY_PLANNER, "stop")
    assert recorded.final is not None and recorded.final.ego.speed_mps < 0.1


@pytest.mark.parametrize(
    "planner", [refuses("distress"), refuses(words="The passenger tells of a medical emergency; I only drive.")]
)
def test_distress_that_a_planner_declines_is_asked_about(planner: Planner) -> None:
    plan = drive("Change to the left lane.", planner).trip.plan
    assert (plan.planner, plan.alarm) == (EMERGENCY_PLANNER, "distress")
    assert QUESTION in plan.thoughts.text and plan.offer


@pytest.mark.parametrize("planner", [refuses("stop"), Answers(Plan(Thoughts("I stop."), Program(STANDING_PROGRAM)))])
def test_words_that_forbid_a_stop_are_no_alarm(planner: Planner) -> None:
    trip = drive("Don't stop, overtake him.", planner).trip
    assert trip.outcome == "refused" and trip.plan.planner != EMERGENCY_PLANNER


def test_a_refusal_that_is_none_of_an_alarm_stays_one() -> None:
    assert drive("sing me a song", refuses()).trip.plan.planner != EMERGENCY_PLANNER


@pytest.mark.parametrize("spec", ["meaning", "onboard"])
def test_what_shipped_planners_read_as_a_stop_is_driven(spec: str) -> None:
    if spec != "meaning":
        pytest.importorskip("onnxruntime")
    assert read_emergency(CALL) is None
    recorded = drive(CALL, make_planner(spec))
    assert recorded.trip.plan.planner == EMERGENCY_PLANNER
    if spec == "meaning":  # where two readers differ, the call is asked about
        assert recorded.final is not None and recorded.final.ego.speed_mps < 0.1


@pytest.mark.parametrize("text", ["Could you halt by that tree?", "Stop at the bakery."])
def test_a_stop_somewhere_is_a_wish_like_others(text: str) -> None:
    assert drive(text, make_planner("meaning")).trip.plan.planner == "meaning"


def test_a_live_drive_is_brought_to_a_stand() -> None:
    place = find("overtake")
    settings = Settings((Start(place, place.seed, most_s=600.0),), planner="meaning", realtime=False, speed=4.0)
    with Runtime(settings) as runtime:
        wish = runtime.ask(CALL)
        end_s = time.monotonic() + WITHIN_S
        while runtime.driving and time.monotonic() < end_s:
            runtime.poll()
            time.sleep(0.005)
        runtime.poll()
        answer = runtime.interactions[wish].answer
        assert answer is not None and (answer.kind, answer.text) == ("interrupted", STOPPING)
        assert runtime.report is not None and runtime.report.outcome == "stopped"


def test_a_vehicle_is_asked_for_a_speed_of_0() -> None:
    file = parse_settings(
        'interface = "rosbridge"\nstack = "autoware.ai"\n[limits]\nmax_speed_mps = 10.0\nlook_ahead_m = [4.0, 10.0]\n'
    )
    vehicle = open_vehicle(file, dry_run=True)

    async def answers() -> list[tuple[str, str]]:
        found: list[tuple[str, str]] = []
        for alarm in ("stop", "distress"):
            async with VehicleSession(vehicle, file, refuses(alarm)) as road:
                answer = await road.ask("Change to the left lane.")
                found.append((answer.status, "" if answer.plan is None else answer.plan.intent))
        return found

    assert asyncio.run(answers()) == [("dry-run", "stop"), ("declined", "ask")]
    vehicle.close()
