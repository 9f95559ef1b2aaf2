"""Every place where a person speaks or types reads emergency words in the same way, before any planner is asked."""

from __future__ import annotations

import asyncio
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from chauffeur.concept import NOBODY, Limits, Parameters, Plan, PlanRequest, Program, Thoughts
from chauffeur.driving.emergency import ASKED, GOING_ON, QUESTION, STOPPING
from chauffeur.driving.live.settings import Settings
from chauffeur.driving.live.starts import Start
from chauffeur.driving.onroad.answers import OnRoadAnswer
from chauffeur.driving.onroad.session import VehicleSession
from chauffeur.driving.recording import RecordedTrip
from chauffeur.driving.scenarios import find
from chauffeur.driving.session import Session, parse_wish
from chauffeur.driving.talk.asr_client import HeardAt
from chauffeur.driving.talk.attention import Attention
from chauffeur.driving.talk.messages import Confirm, Evaluate, HeardWords, Note, Said, Say
from chauffeur.driving.talk.session import Talk
from chauffeur.language.emergency import SAFE_STOP_WISH
from chauffeur.planners.registry import make_planner
from chauffeur.speech.base import Heard
from chauffeur.worlds.ros.factory import open_vehicle
from chauffeur.worlds.ros.settings import parse_settings

STOPS = ("Stop!", "STOP THE CAR", "emergency stop now", "oh god there's a child on the road stop stop")
REFUSALS = ("Don't stop.", "don't brake", "please don't pull over", "no need to stop")
DISTRESS = ("I smell smoke.", "my chest hurts", "we have a flat tyre")
STANDING_PROGRAM = "def halt():\n    set_target_speed(0.0)\n    while True:\n        yield autopilot()\n"
WITHIN_S = 120.0


class Never:
    """A planner that must not be asked."""

    id, model = "never", "none"

    async def plan(self, request: PlanRequest) -> Plan:
        raise AssertionError(request.instruction.text)


class Stands:
    """A planner that takes everything for a stop."""

    id, model = "stands", "none"

    async def plan(self, request: PlanRequest) -> Plan:
        del request
        return Plan(Thoughts("I stop."), Program(STANDING_PROGRAM), intent="stop", planner=self.id)


def drive(text: str, scenario: str, planner: object = None, max_s: float = 15.0) -> RecordedTrip:
    place = find(scenario)
    session = Session(planner=planner or Never(), max_s=max_s)  # pyright: ignore[reportArgumentType]
    return asyncio.run(session.drive(parse_wish(text, NOBODY), place, place.seed, Limits()))


# chauffeur drive ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("text", STOPS)
@pytest.mark.parametrize("scenario", ["overtake", "intersection"])
def test_a_drive_stops_and_says_so(text: str, scenario: str) -> None:
    recorded = drive(text, scenario)
    trip, final = recorded.trip, recorded.final
    assert (trip.outcome, trip.plan.intent) == ("ended", "stop")
    assert final is not None and final.ego.speed_mps < 0.1
    assert final.ego.lane == recorded.frames[0].observation.ego.lane
    assert "Hazard lights on" in trip.said[0][1]
    assert all(frame.applied.acceleration_mps2 >= -5.0 for frame in recorded.frames)
    assert [verdict.check for verdict in trip.verdicts if verdict.stops] == []


@pytest.mark.parametrize("text", REFUSALS)
def test_a_drive_that_is_not_to_stop_goes_on(text: str) -> None:
    recorded = drive(text, "overtake", max_s=5.0)
    final = recorded.final
    assert recorded.trip.outcome == "ended" and recorded.trip.plan.thoughts.text == GOING_ON
    assert final is not None and final.ego.speed_mps > 16.0


@pytest.mark.parametrize("text", DISTRESS)
def test_a_drive_asks_somebody_in_distress(text: str) -> None:
    trip = drive(text, "overtake").trip
    assert (trip.outcome, trip.causes.detail) == ("refused", ASKED)


def test_what_the_question_offers_is_driven_to_the_shoulder_where_there_is_one() -> None:
    recorded = drive(SAFE_STOP_WISH, "emergency-lane", max_s=60.0)
    final = recorded.final
    assert final is not None and final.ego.speed_mps < 0.1
    assert next(lane for lane in final.road.lanes if lane.id == final.ego.lane).emergency
    assert drive(SAFE_STOP_WISH, "overtake").trip.plan.intent == "stop"


@pytest.mark.parametrize("spec", ["keyword", "meaning", "talk2drive", "onboard"])
@pytest.mark.parametrize("text", ["Don't stop at all, overtake him.", "never brake here, take the left lane"])
def test_no_planner_makes_a_stop_of_a_refusal(spec: str, text: str) -> None:
    if spec in ("onboard", "meaning"):
        pytest.importorskip("onnxruntime")
    place = find("quiet-intersection")
    trip = asyncio.run(
        Session(planner=make_planner(spec), max_s=2.0).drive(parse_wish(text, NOBODY), place, place.seed, Limits())
    ).trip
    policy = trip.plan.policy
    if trip.outcome != "refused":
        assert not (isinstance(policy, Parameters) and policy.target_speed_mps < 1.0)
        assert trip.plan.intent.partition(".")[0] not in ("stop", "pull_over")


def test_a_plan_that_stops_all_the_same_is_not_driven() -> None:
    trip = drive("Don't stop, turn left.", "intersection", Stands()).trip
    assert trip.outcome == "refused" and "do not stop" in trip.causes.detail


# Sessions -------------------------------------------------------------------------------------------------------------


def settings(scenario: str = "overtake") -> Settings:
    place = find(scenario)
    return Settings((Start(place, place.seed, most_s=600.0),), planner="keyword", realtime=False, speed=4.0)


def until(talk: Talk, said: list[Said], holds: Callable[[], object]) -> None:
    end_s = time.monotonic() + WITHIN_S
    while not holds():
        assert time.monotonic() < end_s, said
        talk.poll()
        time.sleep(0.005)


def notes(said: list[Said]) -> list[str]:
    return [each.text for each in said if isinstance(each, Note)]


def test_a_session_goes_on_asks_once_and_does_what_a_yes_says() -> None:
    said: list[Said] = []
    with Talk(settings("emergency-lane"), said.append) as talk:
        for text in REFUSALS:
            talk.take(Say(text))
        assert notes(said).count(GOING_ON) == len(REFUSALS) and not talk.stopping
        for answer, still in ((Say("no"), False), (Confirm(yes=True), True)):
            talk.take(Say(DISTRESS[0]))
            asked = [each for each in said if isinstance(each, HeardWords)]
            assert talk.question and asked[-1].reason == QUESTION and asked[-1].to_confirm
            talk.take(answer)
            assert not talk.question and talk.busy is still
        conversations = [each for each in said if each.kind == "conversation"]
        assert conversations == []
        until(talk, said, lambda: any(each.kind == "conversation" and each.stage == "driven" for each in said))  # pyright: ignore
        talk.take(Evaluate(STOPS[2]))  # of the cabin page; lines that are typed have a test below
        assert talk.stopping and STOPPING in notes(said)
        until(talk, said, lambda: not talk.driving)
    assert talk.outcome == "stopped"


def test_a_stop_that_was_heard_badly_is_not_asked_back() -> None:
    acted: list[tuple[str, str]] = []
    said: list[Said] = []
    attention = Attention(None, None, None, said.append, lambda hotword, words: acted.append((hotword, words.text)))
    for text in ("stop the car", "overtake the car"):
        heard = Heard("heard", text, "command", "test", confidence=0.2, to_confirm=True)
        attention._understand(HeardAt(heard, 1.0, 0.5))  # pyright: ignore[reportPrivateUsage]
    assert acted == [("command", "stop the car")]
    assert attention.question is not None and attention.question.text == "overtake the car"


# chauffeur talk -------------------------------------------------------------------------------------------------------


def test_a_drive_by_lines_stops(tmp_path: Path) -> None:
    wishes = tmp_path / "wishes.txt"
    wishes.write_text(f"{STOPS[3]}\n")
    command = [sys.executable, "-c", "from chauffeur.cli.main import run; run()", "talk", "--planner", "keyword"]
    with wishes.open() as lines:
        done = subprocess.run(
            [*command, "--time-scale", "4", "--no-realtime", "--quiet"],
            stdin=lines, capture_output=True, text=True, timeout=WITHIN_S, check=False,
        )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert "The car stands; the drive is over." in done.stdout


# A vehicle ------------------------------------------------------------------------------------------------------------

FILE = """interface = "rosbridge"
stack = "autoware.ai"
[limits]
max_speed_mps = 10.0
look_ahead_m = [4.0, 10.0]
"""


def test_a_vehicle_is_asked_for_a_stop_and_for_none_that_was_refused() -> None:
    file = parse_settings(FILE)
    vehicle = open_vehicle(file, dry_run=True)

    async def steps() -> list[OnRoadAnswer]:
        async with VehicleSession(vehicle, file, Never()) as road:
            texts = (*STOPS, *REFUSALS, *DISTRESS)
            return [await road.ask(text) for text in texts] + [await road.feedback(STOPS[1])]

    answers = asyncio.run(steps())
    vehicle.close()
    stopped = (*answers[: len(STOPS)], answers[-1])
    assert all(one.status == "dry-run" and one.plan is not None and one.plan.intent == "stop" for one in stopped)
    assert all(one.status == "declined" for one in answers[len(STOPS) : -1])
