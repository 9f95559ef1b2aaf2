"""Conversations are what the drive told."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace

import pytest

from chauffeur.concept import (
    Feedback,
    HistoryItem,
    Limits,
    Observation,
    Parameters,
    Plan,
    Program,
    Situation,
    Thoughts,
    Verdict,
)
from chauffeur.driving.episode import make_world
from chauffeur.driving.events import DriveEvent
from chauffeur.driving.live.plan_messages import Request
from chauffeur.driving.live.supervisor import Interaction
from chauffeur.driving.scenarios import find
from chauffeur.driving.session import informed
from chauffeur.driving.talk.conversations import MOST_SAID_SHOWN, Conversations, recalled_of, source_of
from chauffeur.driving.talk.messages import Conversation, HowWasIt
from chauffeur.driving.talk.wish_queue import Words
from chauffeur.safety.checks import DRIVE_CHECKS, run_checks
from chauffeur.safety.faithfulness import FAITHFULNESS_CHECK, check_faithfulness

PLACE = find("overtake")
PROGRAM = Program("def drive():\n    set_target_speed(20.0)\n    yield autopilot()\n")
UNLAWFUL = Program("def drive():\n    set_target_speed(90.0)\n    yield autopilot()\n")
SITUATION = Situation("highway", 25.0, 31.0, 2, 1, False, None, None)


def plan(policy: Program | Parameters = PROGRAM, thoughts: str = "I slow down to 20 m/s.") -> Plan:
    return Plan(Thoughts(thoughts), policy)


def instant() -> Observation:
    world = make_world(PLACE)
    world.reset(PLACE, 3)
    return world.observe()


@dataclass
class Told:
    """A drive, told event by event."""

    conversations: Conversations
    now: list[float]
    interactions: dict[str, Interaction] = field(default_factory=dict[str, Interaction])

    def ask(self, wish: str, words: Words) -> None:
        self.interactions[wish] = Interaction(Request(wish, words.text))
        self.conversations.asked(wish, words)

    def event(self, event: DriveEvent, *, closes: bool = False) -> None:
        interaction = self.interactions[event.wish]
        interaction.events.append(event)
        interaction.stage = {"planned": "planned", "started": "driven"}.get(event.kind, interaction.stage)  # pyright: ignore
        if closes:
            event = replace(event, final=True)
            interaction.stage, interaction.answer = "closed", event
        self.conversations.event(event, interaction)

    def verdicts(self, wish: str, verdicts: tuple[Verdict, ...]) -> Conversation:
        interaction = self.interactions[wish]
        interaction.events.append(DriveEvent("verdicts", wish, trip=1, value=verdicts))
        shown = self.conversations.verdicts(interaction)
        assert shown is not None
        return shown


def drive() -> Told:
    now = [100.0]
    return Told(Conversations(0.1, lambda: now[0]), now)


def report_of(tick: int, plan: str, level: str = "follow"):
    from types import SimpleNamespace

    return SimpleNamespace(tick=tick, plan=plan, level=level, trip=1)  # what `report` reads of a Report


def test_a_wish_from_words_to_set_point_with_where_the_time_went() -> None:
    told = drive()
    told.ask("w1", Words("Slower.", True, ended_s=99.0, wait_s=0.5, recognise_s=0.25))
    told.event(DriveEvent("planning", "w1"))
    told.now[0] = 100.25
    told.conversations.plan("w1", plan())
    told.event(DriveEvent("planned", "w1", "I slow down to 20 m/s."))
    told.now[0] = 100.5
    told.event(DriveEvent("started", "w1", "", 1, 10))
    told.verdicts("w1", run_checks(plan(), instant(), Limits(), DRIVE_CHECKS))
    told.now[0] = 101.0
    told.conversations.report(report_of(11, "w1"))
    shown = told.conversations["w1"]
    assert shown.kind == "conversation" and shown.stage == "driven" and shown.spoken
    assert (shown.policy, shown.source) == ("program", PROGRAM.source)
    stages = shown.stages
    assert (stages.wait_s, stages.recognise_s) == (0.5, 0.25)
    assert (stages.plan_s, stages.check_s, stages.set_point_s, stages.total_s) == (0.25, 0.25, 0.5, 2.0)
    assert [verdict.check for verdict in shown.verdicts if not verdict.informs] == [
        "format-v1", "parameters-v1", "reach-v1", "minimum-speed-v1",
    ]  # fmt: skip
    assert all(verdict.passed for verdict in shown.verdicts)


def test_somebody_is_asked_once_about_a_wish_they_felt() -> None:
    told = drive()
    told.ask("w1", Words("Slower."))
    told.conversations.plan("w1", plan())
    told.event(DriveEvent("started", "w1", "", 1, 10))
    told.conversations.report(report_of(100, "w1"))
    told.conversations.report(report_of(140, "w1"))
    told.conversations.report(report_of(161, "w1"))
    assert told.conversations.to_ask_about(15.0) == HowWasIt("w1", "Slower.")
    told.event(DriveEvent("finished", "w1", "", 1, 170), closes=True)
    assert told.conversations.to_ask_about(15.0) is None
    told.ask("w2", Words("Faster."))
    told.event(DriveEvent("started", "w2", "", 1, 200))
    told.conversations.report(report_of(205, "w2"))
    told.event(DriveEvent("failed", "w2", "It failed.", 1, 205), closes=True)
    assert told.conversations.to_ask_about(15.0) is None, "not felt yet"
    assert told.conversations["w2"].outcome == "failed" and told.conversations["w2"].why == "It failed."
    assert told.conversations.last_felt == "w2" and told.conversations.newest("w2")


def test_a_refusal_shows_the_check_that_refused_and_the_same_reason() -> None:
    told = drive()
    found = run_checks(plan(UNLAWFUL), instant(), Limits(), DRIVE_CHECKS)
    failed = [each for each in found if each.stops]
    reason = " ".join(each.reason for each in failed)
    told.ask("w1", Words("As fast as it goes."))
    told.conversations.plan("w1", plan(UNLAWFUL))
    told.verdicts("w1", found)
    told.event(DriveEvent("refused", "w1", reason, 1, 5), closes=True)
    shown = told.conversations["w1"]
    assert shown.outcome == "refused" and shown.why == reason
    assert [each.check for each in shown.verdicts if not each.passed and not each.informs] == [e.check for e in failed]


@pytest.mark.parametrize("thoughts", ["1" * 8000, "1 " * 4000, "1." * 4000, "(" * 8000, "the left lane " * 570])
def test_thoughts_of_the_longest_kind_are_judged_at_once(thoughts: str) -> None:
    before = time.thread_time()
    assert informed(FAITHFULNESS_CHECK, plan(thoughts=thoughts), instant(), Limits(), check_faithfulness)
    assert (
        time.thread_time() - before < 5.0
    )  # one second on an idle core; what grows faster than the text takes minutes


def test_what_a_plan_says_does_not_grow_without_bound() -> None:
    told = drive()
    told.ask("w1", Words("Slower."))
    for number in range(500):
        told.event(DriveEvent("said", "w1", f"{number} " + 490 * "x"))
    said = told.conversations["w1"].said
    assert len(said) == MOST_SAID_SHOWN
    assert said[-1].startswith("499 ") and said[0].startswith("(")


def test_an_explanation_that_does_not_fit_informs() -> None:
    lies = plan(thoughts="I change to the left lane and speed up to 30 m/s.")
    found = informed(FAITHFULNESS_CHECK, lies, instant(), Limits(), check_faithfulness)
    told = drive()
    told.ask("w1", Words("Left."))
    verdicts = told.verdicts("w1", found).verdicts
    (fits,) = [each for each in verdicts if each.informs]
    assert not fits.passed and fits.reason


def test_parameters_are_shown_one_a_line() -> None:
    text = source_of(Parameters(20.0, 12.0, 1.5, -1, "left"))
    assert text.splitlines() == [
        "target speed: 72 km/h",
        "look ahead: 1.5 s, 12 m at least",
        "lane: one to the left",
        "way: left",
    ]


def test_conflicting_opinions_are_shown_with_both_sides_and_dates() -> None:
    old = HistoryItem("1", "2026-11-01T10:00:00", "Drive faster.", "", "highway", "", "", "",
                      feedback=(Feedback("too fast", speed=-1, strength=0.6),))  # fmt: skip
    new = replace(old, trip_id="2", when="2026-11-05T10:00:00", feedback=(Feedback("too slow", speed=1, strength=0.6),))
    lines = recalled_of((new, old))
    assert lines[:2] == (
        "2026-11-05: “Drive faster.”, you said “too slow”",
        "2026-11-01: “Drive faster.”, you said “too fast”",
    )
    assert lines[2:] == ("You said “too fast” on 2026-11-01 and “too slow” on 2026-11-05: the later one holds.",)
    assert len(recalled_of((new,))) == 1
