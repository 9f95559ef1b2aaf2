"""Wishes for a vehicle in a dry run: what is planned, refused, written down and remembered, without any ROS."""

from __future__ import annotations

import asyncio
import datetime
import math
from collections.abc import Awaitable, Callable
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.concept import (
    NOBODY,
    ConfigError,
    Parameters,
    PersonId,
    Plan,
    PlannerError,
    PlanRequest,
    ProfileError,
    Program,
    Result,
    Thoughts,
)
from chauffeur.driving import questions
from chauffeur.driving.events import DriveEvent
from chauffeur.driving.onroad import session as onroad
from chauffeur.driving.onroad.answers import OnRoadAnswer
from chauffeur.driving.onroad.checks import fitted, is_about_engaging, is_stop
from chauffeur.driving.onroad.session import VehicleSession
from chauffeur.driving.recorder import DriveRecorder, open_vehicle_audit
from chauffeur.memory.vault import VaultMemory
from chauffeur.planners.base import Planner
from chauffeur.planners.registry import make_planner
from chauffeur.safety.audit import read_records, verify, words_of
from chauffeur.worlds.ros import VehicleLimits
from chauffeur.worlds.ros.factory import open_vehicle
from chauffeur.worlds.ros.settings import SENTENCE, VehicleSettings, parse_settings

ANA = PersonId("ana")
FILE = """interface = "rosbridge"
stack = "autoware.ai"
[limits]
max_speed_mps = 10.0
look_ahead_m = [4.0, 10.0]
"""


@pytest.fixture(scope="module")
def embedded() -> Planner:
    return make_planner("talk2drive")


@dataclass
class Asked:
    """A planner of a test: what `answer` gives, or raises."""

    answer: Callable[[PlanRequest], Awaitable[Plan]]
    requests: list[PlanRequest] = field(default_factory=list)
    id: str = "test"
    model: str = "none"

    async def plan(self, request: PlanRequest) -> Plan:
        self.requests.append(request)
        return await self.answer(request)


def gives(*speeds: float, **changed: Any) -> Asked:
    left = list(speeds)

    async def answer(request: PlanRequest) -> Plan:
        speed = left.pop(0) if len(left) > 1 else left[0]
        policy = replace(Parameters(speed, 8.0, 2.0), **changed)
        return Plan(Thoughts("I do."), policy, settings=(("target_speed_mps", speed),), planner="test")

    return Asked(answer)


def drive(
    planner: Planner,
    steps: Callable[[VehicleSession], Awaitable[None]],
    *,
    settings: VehicleSettings | None = None,
    **options: Any,
) -> list[DriveEvent]:
    """A session in a dry run."""
    told: list[DriveEvent] = []
    settings = settings or parse_settings(FILE)
    car = open_vehicle(settings, dry_run=True)

    async def whole() -> None:
        async with VehicleSession(car, settings, planner, tell=told.append, **options) as road:
            await steps(road)

    asyncio.run(whole())
    car.close()
    return told


def ask(planner: Planner, *wishes: str, **options: Any) -> list[OnRoadAnswer]:
    answers: list[OnRoadAnswer] = []

    async def steps(road: VehicleSession) -> None:
        for wish in wishes:
            answers.append(await road.ask(wish))

    drive(planner, steps, **options)
    return answers


def test_words_become_what_would_be_published(embedded: Planner) -> None:
    first, second, third = ask(embedded, "Drive at 20 km/h.", "A bit faster, please.", "Stop!")
    assert [one.status for one in (first, second, third)] == ["dry-run"] * 3
    assert first.published is not None
    assert first.published.messages[0].fields["velocity_max"] == pytest.approx(20.0, abs=0.1)
    assert second.published is not None
    assert 20.5 < float(str(second.published.messages[0].fields["velocity_max"])) < 36.0
    assert third.published is not None
    assert third.published.messages[0].fields["velocity_max"] == 0.0
    assert third.published.messages[1].fields["minimum_lookahead_distance"] == 10.0  # as it was in force
    assert "nothing was published" in third.words


def test_what_is_told_claims_nothing_of_a_road(embedded: Planner) -> None:
    plans: list[str] = []
    contexts: list[str] = []

    async def steps(road: VehicleSession) -> None:
        for wish in (
            "Drive at 20 km/h.",
            "Faster.",
            "Change to the left lane.",
            "Change to the left lane.",
            "Keep 40 m to the car.",
        ):
            await road.ask(wish)

    for event in drive(embedded, steps):
        if event.kind == "plan":
            plans.append(event.text)
        if event.kind == "context":
            contexts.append(event.text)
    assert len(plans) == len(contexts) == 5
    for words in plans:
        for claim in ("near ahead", "within 100 m", "one lane", "no junction", "keep my lane", "allowed"):
            assert claim not in words, words
    assert "looking ahead 2 s along its path, 10 m at least" in plans[0]  # as asked for, not as planned
    assert "dry run" in contexts[0]
    assert "not known" in contexts[0]
    assert "Nothing was asked of it yet" in contexts[0]
    assert "at most 5.6 m/s (20.02 km/h)" in contexts[1]


@pytest.mark.parametrize(
    ("wish", "status", "said"),
    [
        ("A bit faster.", "refused", "How fast the vehicle drives is not known"),
        ("Drive at the speed limit.", "refused", "speed limit here is not known"),
        ("Drive at 90 km/h.", "refused", "above the cap of 36 km/h"),
        ("Change to the left lane.", "refused", "chosen by the vehicle's own planner"),
        ("Bring me a coffee.", "declined", ""),
        ("Engage the vehicle.", "declined", "a person's act"),
        ("  ", "declined", "The wish is empty"),
        ("x" * 3000, "declined", "2000 are the most"),
    ],
)
def test_what_is_not_asked_of_the_vehicle(embedded: Planner, wish: str, status: str, said: str) -> None:
    (answer,) = ask(embedded, wish)
    assert (answer.status, answer.published) == (status, None), answer.words
    assert said in answer.words
    assert answer.result is Result.DECLINED


def test_the_tightest_bound_holds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    home = tmp_path / "limits"
    home.mkdir()
    (home / "limits.toml").write_text("[ana]\nmax_speed_kmh = 18\n")
    monkeypatch.setenv("CHAUFFEUR_HOME", str(home))
    assert ask(gives(4.9), "x", person=ANA)[0].status == "dry-run"
    refused = ask(gives(5.1), "x", person=ANA)[0]
    assert refused.status == "refused"
    assert "18.0 km/h" in refused.words
    assert ask(gives(5.1), "x", person=NOBODY)[0].status == "dry-run"


@pytest.mark.parametrize("speed", [math.nan, math.inf, -1.0, 10.5, 1e300])
def test_numbers_that_are_none_are_refused(speed: float) -> None:
    first, second = ask(gives(5.0, speed), "x", "y")
    assert first.status == "dry-run"
    assert (second.status, second.published) == ("refused", None)


@pytest.mark.parametrize("changed", [{"lane": 1}, {"lane": -1}, {"route": "left"}, {"look_ahead_m": math.nan}])
def test_policies_that_are_none_for_a_vehicle(changed: dict[str, Any]) -> None:
    assert ask(gives(5.0, **changed), "x")[0].status == "refused"


def test_no_words_for_a_vehicle_that_ignores_stops() -> None:
    today = datetime.date(2026, 1, 1)
    said = f'[constant_speed]\nacknowledged_by = "Ana"\nacknowledgement = "{SENTENCE}"\n'
    settings = parse_settings(f"{FILE}{said}until = 2026-01-02\nmax_speed_mps = 3.0\n", today=today)
    with pytest.raises(ConfigError, match="planned stops are ignored"):
        ask(gives(2.0), "x", settings=settings)


def test_a_program_is_no_policy_for_a_vehicle() -> None:
    async def program(request: PlanRequest) -> Plan:
        return Plan(Thoughts(""), Program("def drive():\n    yield autopilot()\n"))

    (answer,) = ask(Asked(program), "x")
    assert answer.status == "refused"
    assert "Use the planner talk2drive" in answer.words


def test_faster_never_means_slower(embedded: Planner) -> None:
    """Held up by traffic at 5 m/s under a cap of 8 m/s, a step up from 5 would be a cap of 6."""

    @dataclass
    class HeldUp:
        inner: Any
        speed_mps: float | None = None

        def __getattr__(self, name: str) -> Any:
            return getattr(self.inner, name)

        def state(self) -> Any:
            return replace(self.inner.state(), speed_mps=self.speed_mps)

    settings = parse_settings(FILE)
    car = HeldUp(open_vehicle(settings, dry_run=True))
    answers: list[OnRoadAnswer] = []

    async def whole() -> None:
        async with VehicleSession(car, settings, embedded) as road:
            answers.append(await road.ask("Drive at 8 m/s."))
            car.speed_mps = 5.0
            answers.append(await road.ask("Faster!"))
            answers.append(await road.ask("Slower."))
            car.speed_mps = 8.0
            answers.append(await road.ask("Faster!"))

    asyncio.run(whole())
    assert [one.status for one in answers] == ["dry-run", "refused", "dry-run", "dry-run"]
    assert "what holds it back is its own planner" in answers[1].words
    assert answers[2].plan is not None
    assert isinstance(answers[2].plan.policy, Parameters)
    assert answers[2].plan.policy.target_speed_mps < 5.0


def test_a_newer_wish_takes_the_place_of_one_that_is_planned() -> None:
    async def forever(request: PlanRequest) -> Plan:
        await asyncio.sleep(600.0)
        raise AssertionError

    slow = Asked(forever)
    answers: list[OnRoadAnswer] = []

    async def steps(road: VehicleSession) -> None:
        older = asyncio.create_task(road.ask("Something slow."))
        while not slow.requests:
            await asyncio.sleep(0.001)
        middle = asyncio.create_task(road.ask("Something else."))
        await asyncio.sleep(0)
        answers.append(await road.ask("stop"))
        answers.extend(await asyncio.gather(older, middle))

    drive(slow, steps)
    assert [one.status for one in answers] == ["dry-run", "superseded", "superseded"]


def test_a_stop_gives_way_to_nothing() -> None:
    answers: list[OnRoadAnswer] = []

    async def steps(road: VehicleSession) -> None:
        stop = asyncio.create_task(road.ask("stop"))
        await asyncio.sleep(0)
        answers.append(await road.ask("Something else."))
        answers.append(await stop)

    drive(gives(5.0), steps)
    assert [one.status for one in answers] == ["dry-run", "dry-run"]
    assert [one.published.number for one in answers if one.published] == [2, 1]


def test_whoever_asks_may_give_up() -> None:
    async def forever(request: PlanRequest) -> Plan:
        await asyncio.sleep(600.0)
        raise AssertionError

    slow = Asked(forever)

    async def steps(road: VehicleSession) -> None:
        task = asyncio.create_task(road.ask("Something slow."))
        while not slow.requests:
            await asyncio.sleep(0.001)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        assert (await road.ask("stop")).status == "dry-run"

    drive(slow, steps)


def test_feedback_takes_no_wish_s_place() -> None:
    go = asyncio.Event()

    async def slow(request: PlanRequest) -> Plan:
        await go.wait()
        return Plan(Thoughts(""), Parameters(5.0, 8.0, 2.0))

    planner = Asked(slow)

    async def steps(road: VehicleSession) -> None:
        wish = asyncio.create_task(road.ask("Drive."))
        while not planner.requests:
            await asyncio.sleep(0.001)
        assert (await road.feedback("too slow")).status == "declined"
        go.set()
        assert (await wish).status == "dry-run"

    drive(planner, steps)


def test_listeners_and_memories_that_fail_take_nothing_down(caplog: pytest.LogCaptureFixture) -> None:
    class Broken:
        def recall(self, *_: Any) -> Any:
            raise ZeroDivisionError

        remember = attach_feedback = recall

    def deaf(event: DriveEvent) -> None:
        raise ValueError

    settings = parse_settings(FILE)

    async def whole() -> None:
        car = open_vehicle(settings, dry_run=True)
        road = VehicleSession(car, settings, gives(5.0), person=ANA, memory=Broken(), tell=deaf)  # type: ignore[arg-type]
        async with road:
            assert (await road.ask("Drive.")).status == "dry-run"
            assert (await road.feedback("fine")).status == "declined"
        after = await road.ask("Drive.")
        assert (after.status, after.words) == ("failed", "The session is over.")

    asyncio.run(whole())
    assert "memory failed" in caplog.text


def test_a_fault_of_ours_ends_one_wish(caplog: pytest.LogCaptureFixture) -> None:
    settings = parse_settings(FILE)
    car: Any = open_vehicle(settings, dry_run=True)
    faults = [ZeroDivisionError()]

    class Faulty:
        def __getattr__(self, name: str) -> Any:
            return getattr(car, name)

        def apply(self, parameters: Parameters) -> Any:
            if faults:
                raise faults.pop()
            return car.apply(parameters)

    async def whole() -> list[OnRoadAnswer]:
        async with VehicleSession(Faulty(), settings, gives(5.0)) as road:
            return [await road.ask("x"), await road.ask("y")]

    first, second = asyncio.run(whole())
    assert (first.status, second.status) == ("failed", "dry-run")
    assert "Chauffeur itself failed: ZeroDivisionError. Nothing was published." in first.words


def test_planners_that_fail(monkeypatch: pytest.MonkeyPatch) -> None:
    async def broken(request: PlanRequest) -> Plan:
        raise PlannerError("The endpoint is down.")

    async def buggy(request: PlanRequest) -> Plan:
        raise ZeroDivisionError

    async def late(request: PlanRequest) -> Plan:
        await asyncio.sleep(600.0)
        raise AssertionError

    assert "endpoint is down" in ask(Asked(broken), "x")[0].words
    assert "ZeroDivisionError" in ask(Asked(buggy), "x")[0].words
    monkeypatch.setattr(onroad, "PLAN_WITHIN_S", 0.01)
    assert "No plan within" in ask(Asked(late), "x")[0].words
    monkeypatch.setattr(onroad, "START_WITHIN_S", 0.0)
    old = ask(gives(5.0), "x")[0]
    assert (old.status, old.published) == ("failed", None)
    assert "elsewhere by now" in old.words


@pytest.mark.parametrize("asked_for", [True, False])
def test_it_is_remembered_and_recalled(tmp_path: Path, embedded: Planner, asked_for: bool) -> None:
    memory = VaultMemory(tmp_path / "home")
    answers: list[OnRoadAnswer] = []

    async def steps(road: VehicleSession) -> None:
        answers.append(await road.ask("Drive at 30 km/h."))
        opinion = "That was too fast."
        answers.append(await road.feedback(opinion) if asked_for else await road.ask(opinion))

    drive(embedded, steps, person=ANA, memory=memory)
    assert answers[0].status == "dry-run" and (answers[1].status == "taken" or not asked_for)
    recalled: list[Any] = []

    async def again(road: VehicleSession) -> None:
        await road.ask("Drive at 30 km/h.")

    for event in drive(embedded, again, person=ANA, memory=memory):
        if event.kind == "history":
            recalled.append(event.value)
    (item,) = [each for each in recalled[0].items if each.instruction == "Drive at 30 km/h."]
    assert (item.world, item.outcome) == ("vehicle", "not_driven")
    assert "dry run" in item.context
    assert item.feedback[0].speed == -1


def test_a_trip_says_what_it_was_and_what_was_not_measured(embedded: Planner) -> None:
    kept: list[Any] = []

    class Kept:
        def recall(self, *_: Any) -> Any:
            raise ProfileError("The profile is locked.")

        def remember(self, trip: Any, feedback: Any) -> None:
            kept.append(trip)

    told = []

    async def steps(road: VehicleSession) -> None:
        assert (await road.ask("Drive at 30 km/h.")).status == "dry-run"
        assert (await road.ask("Change to the left lane.")).status == "refused"

    told = drive(embedded, steps, person=ANA, memory=Kept())
    assert any(event.kind == "trouble" and "locked" in event.text for event in told)
    first, second = kept
    record = dict(first.record)
    assert (record["simulated"], record["dry_run"], record["interface"]) == (False, True, "rosbridge")
    assert first.metrics == ()
    assert first.duration_s == 0.0
    assert "nothing of gaps" in record["metrics_absent"]
    assert (first.outcome, second.outcome) == ("not_driven", "refused")
    assert first.id != second.id


def test_feedback_without_a_drive(tmp_path: Path, embedded: Planner) -> None:
    said: list[OnRoadAnswer] = []

    async def steps(road: VehicleSession) -> None:
        said.append(await road.feedback("too fast"))
        said.append(await road.feedback("  "))

    drive(embedded, steps)
    drive(embedded, steps, person=ANA, memory=VaultMemory(tmp_path / "home"))
    assert [one.status for one in said] == ["declined"] * 4


def test_the_log_holds_it_before_it_is_asked(tmp_path: Path, embedded: Planner) -> None:
    path, file = tmp_path / "audit.jsonl", tmp_path / "vehicle.toml"
    file.write_text(FILE)
    seen: list[list[str]] = []
    settings = parse_settings(FILE)
    car: Any = open_vehicle(settings, dry_run=True)
    apply = car.apply

    class Watched:
        def __getattr__(self, name: str) -> Any:
            return getattr(car, name)

        def apply(self, parameters: Parameters) -> Any:
            seen.append([record.kind for _, record in read_records(path)])  # what a power cut would leave
            return apply(parameters)

    async def whole() -> None:
        with open_vehicle_audit(path, file, "rosbridge", dry_run=True) as books:
            async with VehicleSession(Watched(), settings, embedded, person=ANA, books=books) as road:
                await road.ask("Drive at 20 km/h.")
                await road.feedback("nice")
                await road.ask("Change to the left lane.")

    asyncio.run(whole())
    assert seen[0][-3:] == ["verdict", "verdict", "actuation"]
    found = verify(path)
    assert found.ok
    records = [record for _, record in read_records(path)]
    opened = records[0].body
    assert (opened["simulated"], opened["dry_run"]) == (False, True)
    assert "dry run" in opened["drive"]
    acts = [record.body for record in records if record.kind == "actuation"]
    assert [(one["wish"], one["done"]) for one in acts] == [(1, False), (1, True)]
    assert acts[0]["parameters"]["target_speed_mps"] == pytest.approx(5.56)
    assert acts[1]["status"] == "dry-run"
    outcomes = [record for record in records if record.kind == "outcome"]
    assert [one.body.get("outcome", one.body.get("event")) for one in outcomes] == ["dry-run", "refused", "over"]
    assert words_of(outcomes[0])["person"] == "ana"
    letters = [record.body["letter"] for record in records if "letter" in record.body]
    assert letters == ["C", "H", "S", "F", "C", "H", "S"]


class Full(DriveRecorder):
    """Books on a disk that takes nothing."""

    def kept(self, within_s: float = 0.0) -> Future[bool]:
        never: Future[bool] = Future()
        never.set_result(False)
        return never


def test_what_cannot_be_written_down_is_not_asked_unless_it_slows(tmp_path: Path) -> None:
    file = tmp_path / "vehicle.toml"
    file.write_text(FILE)
    log = open_vehicle_audit(tmp_path / "audit.jsonl", file, "rosbridge", dry_run=True)
    with Full(log.log) as books:
        answers = ask(gives(5.0), "x", "stop", books=books)
    assert [one.status for one in answers] == ["failed", "dry-run"]
    assert "Nothing was published" in answers[0].words


def test_a_wish_is_told_of_in_the_order_in_which_it_is_worked_on(embedded: Planner) -> None:
    told: list[DriveEvent] = []

    async def drive() -> OnRoadAnswer:
        settings = parse_settings(FILE)
        car = open_vehicle(settings, dry_run=True)
        async with VehicleSession(car, settings, embedded, tell=told.append) as road:
            answer = await road.ask("Drive at 20 km/h.")
        car.close()
        return answer

    answer = asyncio.run(drive())
    assert (answer.status, answer.result) == ("dry-run", Result.DONE)
    kinds = ("wish", "context", "plan", "verdicts", "asking", "asked", "answer", "over")
    assert [event.kind for event in told if event.kind in kinds] == list(kinds)


def test_it_ends_with_what_stays(embedded: Planner) -> None:
    async def steps(road: VehicleSession) -> None:
        await road.ask("Drive at 20 km/h.")
        assert road.asked is not None

    last = drive(embedded, steps)[-1]
    assert last.kind == "over"
    assert "dry run" in last.text


STOPS = ("stop", "Stop!", " STOP now. ", "please stop", "Stop, please!", "halt")
NO_STOPS = ("do not stop", "stop at the bakery", "non-stop", "don't stop", "stop tailgating him", "")


def test_a_stop_needs_no_planner_and_other_words_are_none() -> None:
    async def never(request: PlanRequest) -> Plan:
        raise AssertionError

    assert all(is_stop(text) for text in STOPS) and not any(is_stop(text) for text in NO_STOPS)
    assert {one.status for one in ask(Asked(never), *STOPS)} == {"dry-run"}


@given(st.text(max_size=60))
def test_any_words_are_read(text: str) -> None:
    if is_stop(text):
        assert not is_about_engaging(text)


@given(st.floats(), st.floats(), st.floats(), st.floats(1.0, 10.0), st.floats(10.0, 50.0))
def test_only_the_look_ahead_is_fitted(speed: float, look: float, ratio: float, low: float, high: float) -> None:
    plan = Plan(Thoughts(""), Parameters(speed, look, ratio), settings=(("target_speed_mps", speed), ("x", 3.0)))
    found = fitted(plan, VehicleLimits(8.0, (low, high), (0.5, 4.0)), 8.0)
    assert isinstance(found.policy, Parameters)
    if not 8.0 < speed <= 8.01:
        assert str(found.policy.target_speed_mps) == str(speed)
    else:
        assert found.policy.target_speed_mps == 8.0
    assert [str(value) for _, value in found.settings] == [str(found.policy.target_speed_mps), "3.0"]
    for value, before, bounds in (
        (found.policy.look_ahead_m, look, (low, high)),
        (found.policy.look_ahead_ratio, ratio, (0.5, 4.0)),
    ):
        if math.isfinite(before):
            assert bounds[0] <= value <= bounds[1]
        else:
            assert not math.isfinite(value)  # the checks refuse it


@pytest.mark.parametrize(
    ("speed", "asked"), [(10.0, 10.0), (10.005, 10.0), (10.01, 10.0), (10.02, None), (9.999, 9.999)]
)
def test_hundredths_above_the_cap_are_no_more_than_the_cap(speed: float, asked: float | None) -> None:
    (answer,) = ask(gives(speed), "x")
    if asked is None:
        assert answer.status == "refused"
    else:
        assert answer.published is not None
        assert answer.published.messages[0].fields["velocity_max"] == pytest.approx(asked * 3.6, abs=0.001)


@pytest.mark.parametrize(
    ("answer", "within_s", "statuses"),
    [
        ("Yes.", 20.0, ["declined", "dry-run"]),
        ("No.", 20.0, ["declined", "declined"]),
        ("Yes.", -1.0, ["declined", "declined"]),
        ("Stop!", 20.0, ["declined", "dry-run"]),
    ],
    ids=["yes", "no", "late", "stop"],
)
def test_a_question_is_settled_by_what_is_said_next(
    monkeypatch: pytest.MonkeyPatch, answer: str, within_s: float, statuses: list[str]
) -> None:
    """A yes in time is the wish that was asked about; a no asks for nothing, nor does a yes to what nobody recalls."""
    monkeypatch.setattr(questions, "ANSWER_WITHIN_S", within_s)

    async def asks(request: PlanRequest) -> Plan:
        if request.instruction.confirmed == "Did you mean 5 m/s?":
            return Plan(Thoughts("I do."), Parameters(5.0, 8.0, 2.0), settings=(("target_speed_mps", 5.0),))
        return Plan(Thoughts("?"), None, "Did you mean 5 m/s?", offer="Drive at 5 m/s.", intent="ask")

    planner = Asked(asks)
    answers = ask(planner, "Drive at S m/s.", answer)
    assert [one.status for one in answers] == statuses
    confirmed = [one.instruction.text for one in planner.requests if one.instruction.confirmed]
    assert set(confirmed) == {"Drive at 5 m/s."}, "whether a yes could be driven is seen before it is asked"
    if answer == "No.":
        assert answers[1].words == questions.NOT_MEANT


def test_a_question_to_which_a_yes_would_be_refused_is_not_asked() -> None:
    async def asks(request: PlanRequest) -> Plan:
        if request.instruction.confirmed:
            return Plan(Thoughts("I do."), Parameters(50.0, 8.0, 2.0), settings=(("target_speed_mps", 50.0),))
        return Plan(Thoughts("?"), None, "Did you mean 50 m/s?", offer="Drive at 50 m/s.", intent="ask")

    (answer,) = ask(Asked(asks), "Drive at SO m/s.")
    assert answer.status == "declined"
    assert answer.plan is not None
    assert answer.plan.offer == ""
    assert "50 m/s" not in answer.words
    assert "180 km/h" in answer.words


def test_never_mind_goes_back_to_what_was_in_force_before_the_newest_wish() -> None:
    planner = gives(5.0, 8.0)
    answers = ask(planner, "Drive at 5 m/s.", "never mind", "Drive at 8 m/s.", "never mind", "forget it")
    assert [one.status for one in answers] == ["dry-run", "answered", "dry-run", "dry-run", "answered"]
    assert len(planner.requests) == 2
    back = answers[3].plan
    assert back is not None
    assert isinstance(back.policy, Parameters)
    assert back.policy.target_speed_mps == 5.0
    assert answers[4].words == questions.NOTHING_ASKED


def test_planners_of_a_vehicle_are_asked_in_whole_sentences() -> None:
    planner = gives(5.0, 4.0)
    ask(planner, "Drive at 20 km/h.", "make it 15")
    assert [one.instruction.text for one in planner.requests] == ["Drive at 20 km/h.", "Drive at 15 km/h."]
    assert planner.requests[1].instruction.said == "make it 15"
