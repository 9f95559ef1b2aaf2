"""Both sides of a conflict reach the planner that uses one of them, and the person."""

from __future__ import annotations

import asyncio
from typing import Literal

from chauffeur.concept import (
    Context,
    Feedback,
    History,
    HistoryItem,
    Instruction,
    PlanRequest,
    Situation,
    SystemMessage,
)
from chauffeur.planners.registry import make_planner
from chauffeur.planners.talk2drive.planner import messages_for

HIGHWAY = Situation("highway", 20.0, 31.3, 3, 1, False, None, None)


def trip(when: str, said: str, speed: Literal[-1, 1]) -> HistoryItem:
    feedback = (Feedback(said, speed=speed, strength=0.6),)
    return HistoryItem(f"t{when}", when, "Hurry up.", "", "highway", "style.hurry", "", "fast", (), feedback)


def request(*items: HistoryItem) -> PlanRequest:
    return PlanRequest(
        Instruction("Hurry up."), Context("I am on a highway.", HIGHWAY), SystemMessage(""), History(items)
    )


OLD, NEW = trip("2026-11-12T10:00:00.000+00:00", "Too slow.", 1), trip("2026-11-21T10:00:00.000+00:00", "Too fast.", -1)


def test_a_model_is_told_both_sides_as_data() -> None:
    text = messages_for(request(OLD, NEW))[1]["content"]
    assert (
        'speed: "Too slow." (said of the drive 2026-11-12T10:00) is contradicted by "Too fast." '
        "(said of the drive 2026-11-21T10:00); the later one holds."
    ) in text
    assert text.count("</data>") == text.count("<data ")
    assert "contradict" not in messages_for(request(NEW))[1]["content"]


def test_the_person_is_told_which_side_is_used() -> None:
    planner = make_planner("talk2drive")
    plan = asyncio.run(planner.plan(request(NEW, OLD)))
    told = 'You said "Too slow." on 2026-11-12 and "Too fast." on 2026-11-21; I go by the later.'
    assert plan.thoughts.text.count(told) == 1
    assert "You said" not in asyncio.run(planner.plan(request(NEW))).thoughts.text
