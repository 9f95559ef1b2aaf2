"""The planner process in one piece: every wish gets an answer, whatever the planner does."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from live_bench import OVERTAKE, Bench

from chauffeur.concept import ConfigError, Plan, PlanRequest, Program, Thoughts
from chauffeur.describe import describe_with_traffic
from chauffeur.driving.events import FINAL, DriveEvent
from chauffeur.driving.live import planner as module
from chauffeur.driving.live.mirror import Mirror
from chauffeur.driving.live.plan_messages import (
    TAKES_BACK,
    PlanMessage,
    Request,
    encode,
    read_brief,
    read_event,
    read_order,
)
from chauffeur.driving.live.planner import Planning, PlanningRings
from chauffeur.driving.live.ring import Reader, Ring
from chauffeur.driving.live.settings import SIZES, RingName
from chauffeur.driving.session import Forgetful
from chauffeur.planners.base import Planner
from chauffeur.planners.registry import make_planner
from chauffeur.worlds.highway import HighwayWorld

PLAN = Plan(Thoughts("I hold it."), Program("def drive():\n    yield autopilot()\n"), planner="written")


class Written:
    """A planner that does what its wish names."""

    id, model = "written", "none"

    async def plan(self, request: PlanRequest) -> Plan:
        match request.instruction.text.split()[0]:
            case "wait":
                await asyncio.sleep(30.0)
            case "raise":
                raise ConfigError("No such model.")
            case "fault":
                raise ZeroDivisionError("oops")
            case "turn":
                return Plan(Thoughts(""), None, refusal="Cars cannot fly.")
            case "follow":
                return Plan(Thoughts(""), None)
            case "long":
                return Plan(Thoughts(""), Program("#" * 400_000))
            case _:
                pass
        return PLAN


class Rig:
    def __init__(self, folder: Path, planner: Planner) -> None:
        self.bench = Bench(folder, (OVERTAKE,))
        self.bench.control.begin_trip()
        names: tuple[RingName, ...] = ("requests", "orders", "briefs", "planner_events")
        self.requests, self.orders, self.briefs, self.events = (
            Ring(folder / name, *SIZES[name], create=True) for name in names
        )
        self.planning = Planning(
            Mirror(HighwayWorld(), (OVERTAKE,), self.bench.observations),
            PlanningRings(self.requests, self.orders, self.briefs, self.events),
            planner,
            Forgetful(),
            clock_ns=lambda: self.bench.now_ns,
        )

    def ask(self, *texts: str) -> None:
        for k, text in enumerate(texts, 1):
            self.requests.write(encode(Request(f"w{k}", text)))

    async def answered(self) -> list[tuple[str, str]]:
        await self.planning.look()
        await self.planning.finish()
        return self.kinds()

    def told(self) -> list[DriveEvent]:
        events = [read_event(message.payload) for message in Reader(self.events, old=True).news()[0]]
        return [event for event in events if event.kind != "verdicts"]  # the policy's tests look at those

    def kinds(self) -> list[tuple[str, str]]:
        return [(event.kind, event.wish) for event in self.told()]

    def ordered(self) -> PlanMessage:
        message = self.orders.latest()
        assert message is not None
        return read_order(message.payload)


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[Rig]:
    yield Rig(tmp_path, Written())


def test_a_wish_becomes_an_order_that_says_what_it_was_made_for(rig: Rig) -> None:
    rig.bench.tick()
    rig.ask("go")
    assert asyncio.run(rig.answered()) == [("planning", "w1"), ("planned", "w1")]
    order = rig.ordered()
    assert (order.wish, order.plan, order.scene.trip, order.scene.tick) == ("w1", PLAN, 1, 1)
    assert order.scene.lane == rig.bench.world.observe().ego.lane
    assert order.issued_ns < order.start_by_ns < order.expires_ns


@pytest.mark.parametrize(
    ("wish", "kind", "words"),
    [
        ("turn left here", "declined", "cannot fly"),
        ("follow the truck", "declined", "no program"),
        ("raise", "unplanned", "No such model"),
        ("fault", "unplanned", "ZeroDivisionError"),
        ("long", "unplanned", "does not fit"),
        ("x" * 3000, "unplanned", "3000 characters"),
    ],
)
def test_what_goes_wrong_is_an_answer(rig: Rig, wish: str, kind: str, words: str) -> None:
    rig.ask(wish)
    assert asyncio.run(rig.answered()) == [("planning", "w1"), (kind, "w1")]
    assert words in rig.told()[-1].text
    assert rig.orders.latest() is None


def test_what_a_plan_was_made_of_is_left_for_the_books(rig: Rig) -> None:
    rig.bench.tick()
    rig.ask("turn left here")
    asyncio.run(rig.answered())
    message = rig.briefs.latest()
    assert message is not None
    brief = read_brief(message.payload)
    assert (brief.wish, brief.instruction.text, brief.trip, brief.tick) == ("w1", "turn left here", 1, 1)
    assert brief.context == describe_with_traffic(rig.bench.world.observe())
    assert (brief.history.items, brief.plan.refusal) == ((), "Cars cannot fly.")


def test_a_planner_without_end_is_given_up_on(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "PLAN_WITHIN_S", 0.05)
    rig.ask("wait")
    assert asyncio.run(rig.answered()) == [("planning", "w1"), ("unplanned", "w1")]


def test_a_newer_wish_ends_the_work_on_an_older_one_and_all_are_answered(rig: Rig) -> None:
    async def drive() -> None:
        rig.ask("wait", "go there", "wait")
        await rig.planning.look()
        await asyncio.sleep(0.02)
        rig.requests.write(encode(Request("w4", "go")))
        await rig.planning.look()
        await rig.planning.finish()

    asyncio.run(drive())
    assert rig.kinds() == [
        ("superseded", "w1"),
        ("superseded", "w2"),
        ("planning", "w3"),
        ("superseded", "w3"),
        ("planning", "w4"),
        ("planned", "w4"),
    ]


@pytest.mark.parametrize("aside", ["Why are we standing?", "are we there yet", "Is that a church?", "ok", "Thank you!"])
def test_what_is_said_aside_ends_no_work_on_a_wish(rig: Rig, aside: str) -> None:
    async def drive() -> None:
        rig.ask("wait")
        await rig.planning.look()
        await asyncio.sleep(0.02)
        rig.requests.write(encode(Request("w2", aside, runs=True)))
        await rig.planning.look()
        until_s = time.monotonic() + 20.0
        while not any(wish == "w2" and kind in (*FINAL, "planned") for kind, wish in rig.kinds()):
            assert time.monotonic() < until_s
            await asyncio.sleep(0.01)
        assert ("superseded", "w1") not in rig.kinds()
        rig.requests.write(encode(Request("w3", "go")))
        await rig.planning.look()
        await rig.planning.finish()

    asyncio.run(drive())
    assert rig.kinds()[-3:] == [("superseded", "w1"), ("planning", "w3"), ("planned", "w3")]


@pytest.mark.parametrize(
    ("request_", "kind"),
    [
        (Request("w1", "Why so slow, go?", runs=True), "planned"),
        (Request("w1", "Do we go faster now?", runs=True), "declined"),
        (Request("w1", "Do we go faster now?", confirmed="Did you mean it?", runs=True), "planned"),
        (Request("w1", "Do we go faster now?"), "planned"),
        (Request("w1", "Could you go faster?", runs=True), "planned"),
    ],
    ids=["wish after it", "while one runs", "confirmed", "nothing runs", "request"],
)
def test_a_question_ends_what_runs_only_after_a_yes(rig: Rig, request_: Request, kind: str) -> None:
    rig.requests.write(encode(request_))
    assert asyncio.run(rig.answered())[-1] == (kind, "w1")
    assert rig.told()[-1].offer == (request_.text if kind == "declined" else "")


def test_garbage_among_the_wishes_is_told_of(rig: Rig) -> None:
    rig.requests.write(b"\xff")
    rig.ask("go")
    assert asyncio.run(rig.answered()) == [("garbage", ""), ("planning", "w1"), ("planned", "w1")]


def test_at_the_end_of_the_drive_the_wish_at_hand_is_answered(rig: Rig) -> None:
    rig.ask("wait")
    looks = iter([False, False, True])
    asyncio.run(rig.planning.run(lambda: next(looks)))
    assert rig.kinds() == [("planning", "w1"), ("superseded", "w1")]


def test_the_onboard_planner_plans_for_what_control_shows(tmp_path: Path) -> None:
    rig = Rig(tmp_path, make_planner("meaning"))
    for _ in range(10):
        rig.bench.tick()
    rig.ask("Slow down to 20 m/s")
    assert asyncio.run(rig.answered()) == [("planning", "w1"), ("planned", "w1")]
    assert isinstance(rig.ordered().plan.policy, Program)
    assert rig.ordered().scene.tick == 10


class Repeats(Written):
    """A planner that keeps what it is asked."""

    def __init__(self) -> None:
        self.asked: list[PlanRequest] = []

    async def plan(self, request: PlanRequest) -> Plan:
        self.asked.append(request)
        return await super().plan(request)


def _said(rig: Rig, *texts: str) -> list[PlanRequest]:
    """What a planner is asked where a person says these in turn, the last while a wish is driven."""
    planner = Repeats()
    rig.planning._planner = planner  # pyright: ignore[reportPrivateUsage, reportAttributeAccessIssue]
    for k, text in enumerate(texts, 1):
        rig.requests.write(encode(Request(f"w{k}", text, runs=k > 1)))
        asyncio.run(rig.answered())
    return planner.asked


@pytest.mark.parametrize(
    ("texts", "whole"),
    [
        (("slow down", "a bit more"), "Slow down a bit."),
        (("drive at 50 km/h", "make it 40"), "Drive at 40 km/h."),
        (("change to the left lane", "back as it was"), "Change back to the original lane."),
    ],
)
def test_planners_are_asked_in_whole_sentences(rig: Rig, texts: tuple[str, ...], whole: str) -> None:
    _, last = _said(rig, *texts)
    assert (last.instruction.text, last.instruction.said) == (whole, texts[-1])
    assert last.utterance is not None
    assert last.utterance.text == texts[-1]


def test_words_that_mean_nothing_alone_are_asked_about(rig: Rig) -> None:
    assert _said(rig, "a bit more") == []
    assert rig.kinds()[-1] == ("declined", "w1")


def test_what_is_driven_is_taken_back_by_an_order(rig: Rig) -> None:
    assert len(_said(rig, "slow down", "never mind")) == 1
    assert (rig.ordered().wish, rig.ordered().plan.policy, rig.ordered().plan.intent) == ("w2", None, TAKES_BACK)


def test_a_wish_on_its_way_is_taken_back_without_an_order(rig: Rig) -> None:
    async def drive() -> None:
        rig.ask("wait")
        await rig.planning.look()
        await asyncio.sleep(0.02)
        rig.requests.write(encode(Request("w2", "never mind", runs=True)))
        await rig.planning.look()
        await rig.planning.finish()

    asyncio.run(drive())
    assert rig.kinds()[1:] == [("superseded", "w1"), ("planning", "w2"), ("answered", "w2")]
    assert rig.orders.latest() is None
