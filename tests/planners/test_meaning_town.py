"""Acts as a program of a town: whatever is said comes to a program, a question, or a reason in words."""

from __future__ import annotations

import asyncio
import itertools
from typing import get_args

import pytest

pytest.importorskip("libsumo")

from chauffeur.concept import Instruction, Limits, PlanRequest
from chauffeur.concept.utterance import Act, Condition, ConditionKind, Event, Reference, Utterance, Verb
from chauffeur.driving.scenarios import find
from chauffeur.driving.session import Session
from chauffeur.planners.meaning import MeaningPlanner
from chauffeur.planners.meaning.compose import compose
from chauffeur.programs.gate import check_source


@pytest.fixture(scope="module")
def request_() -> PlanRequest:
    scene = find("town-street")
    session = Session(planner=MeaningPlanner())
    return asyncio.run(session.request(Instruction("Drive on."), scene, scene.seed, Limits()))


@pytest.mark.parametrize("event", get_args(Event))
def test_every_condition_is_composed_asked_about_or_declined(request_: PlanRequest, event: Event) -> None:
    seen, context = request_.observation, request_.context
    assert seen is not None
    references = (None, Reference("bus"), Reference("vehicle"), Reference("pedestrians"), Reference("light"))
    ways = itertools.product(get_args(Verb), get_args(ConditionKind), references)
    answers = set[str]()
    for verb, kind, reference in ways:
        act = Act(verb, side="left", when=Condition(kind, event, reference, value=3.0))
        made = compose(Utterance("", (act,)), seen, context.situation, Limits())
        answer = "asks" if made.question else "declines" if made.undoable else "drives" if made.source else "nothing"
        if made.source:
            assert check_source(made.source, made.library, "town").passed
        answers.add(answer)
    assert answers & {"drives", "declines"}, answers
