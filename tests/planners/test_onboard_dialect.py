"""The dialect: what is written is read back, every text of it is a program of the language; nothing else is read."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.concept import LAMPILOT_LIMITS, Lead, ProgramError, Situation
from chauffeur.planners.onboard.dialect import (
    CONDITIONS,
    MANNERS,
    MAX_STEPS,
    SKILLS,
    UNITS,
    DialectStep,
    Number,
    StepCondition,
    read,
    tell,
    write,
)
from chauffeur.planners.onboard.link import Linked, link
from chauffeur.planners.onboard.options import Declined
from chauffeur.planners.onboard.personal import Leaning
from chauffeur.planners.onboard.prompt import ASK, REFUSE, program_reply
from chauffeur.planners.onboard.reply import read_reply
from chauffeur.programs.gate import check_source

HIGHWAY = Situation("highway", 25.0, 31.3, 4, 1, True, Lead(1, 35.0, 22.0), None)
CROSSING = Situation("intersection", 10.0, 13.0, 1, 0, False, None, 60.0, ("left", "straight", "right"))


def numbers(kind: str) -> st.SearchStrategy[Number]:
    units = ["", *(unit for unit, (what, _, _) in UNITS.items() if what == kind)]
    values = st.integers(1, 80).map(float) | st.sampled_from([0.5, 1.5, 2.25])
    return st.builds(Number, values, st.sampled_from(units), st.sampled_from([1.0, 1.0, 0.85, 1.15]))


@st.composite
def steps(draw: st.DrawFn) -> DialectStep:
    skill = SKILLS[draw(st.sampled_from(sorted(SKILLS)))]
    number = None if skill.takes is None else draw(numbers(skill.takes))
    condition = None
    if draw(st.booleans()):
        name = draw(st.sampled_from(sorted(CONDITIONS)))
        kind = CONDITIONS[name][0]
        condition = StepCondition(
            draw(st.sampled_from(["if", "once"])), name, None if kind is None else draw(numbers(kind))
        )
    wait = draw(st.none() | numbers("time"))
    return DialectStep(skill.name, number, draw(st.sampled_from(["", *MANNERS])), wait, condition)


@given(st.lists(steps(), min_size=1, max_size=MAX_STEPS))
def test_what_is_written_is_read_back(some: list[DialectStep]) -> None:
    source = write(some)
    assert read(source) == tuple(some)
    assert read_reply(program_reply(some)).steps == tuple(some)
    for step in some:
        if step.number is not None and SKILLS[step.skill].takes is not None:
            assert f"{step.number.value:g}" in tell(some)


@pytest.mark.parametrize(
    "source",
    [
        "",
        "def drive():\n    pass\n",
        "def go():\n    yield from faster()\n",
        "def drive(x):\n    yield from faster()\n",
        "def drive():\n    yield from fly()\n",
        "def drive():\n    yield from faster(3)\n",
        "def drive():\n    yield from drive_at()\n",
        "def drive():\n    yield from drive_at(feet(30))\n",
        "def drive():\n    yield from drive_at(-5)\n",
        "def drive():\n    yield from drive_at(1e9)\n",
        "def drive():\n    yield from drive_at(True)\n",
        "def drive():\n    yield from drive_at(__import__('os'))\n",
        "def drive():\n    faster()\n",
        "def drive():\n    set_target_speed(70.0)\n    yield from faster()\n",
        "def drive():\n    while True:\n        yield autopilot()\n",
        "def drive():\n    while not clear_left():\n        yield autopilot()\n",
        "def drive():\n    if clear_left():\n        yield from faster()\n    else:\n        yield from slower()\n",
        "def drive():\n    yield from wait(3)\n",
        "def drive():\n" + "    yield from faster()\n" * 4,
        "import os\ndef drive():\n    yield from faster()\n",
        "def drive():\n    yield from faster()\n" + "# " + "x" * 600,
    ],
)
def test_nothing_else_is_read(source: str) -> None:
    with pytest.raises(ProgramError):
        read(source)


def test_replies_are_programs_questions_or_refusals() -> None:
    assert read_reply(f"{ASK}Left or right?").question == "Left or right?"
    assert read_reply(f"{REFUSE}I only drive.").refusal == "I only drive."
    with pytest.raises(ProgramError):
        read_reply("Sure, I will drive faster.")


@pytest.mark.parametrize("situation", [HIGHWAY, CROSSING], ids=["highway", "crossing"])
@pytest.mark.parametrize("skill", sorted(SKILLS))
def test_every_skill_links_to_a_program_that_passes_the_gate(skill: str, situation: Situation) -> None:
    value = {"speed": 20.0, "distance": 30.0, "time": 2.0, "factor": 0.8, "lanes": 1.0, None: 0.0}[SKILLS[skill].takes]
    step = DialectStep(skill, None if SKILLS[skill].takes is None else Number(value), "gently")
    linked = link([step], situation, LAMPILOT_LIMITS, lambda _: Leaning())
    if isinstance(linked, Declined):
        assert linked.words
        return
    report = check_source(write([step]), linked.library)
    assert report.passed, report.findings


def linked(*some: DialectStep) -> Linked:
    found = link(some, HIGHWAY, LAMPILOT_LIMITS, lambda _: Leaning())
    assert isinstance(found, Linked)
    return found


def test_conditions_waits_and_units_are_in_the_library() -> None:
    step = DialectStep(
        "overtake_left", None, "", Number(10.0), StepCondition("once", "lead_closer_than", Number(100.0, "feet"))
    )
    library = linked(step).library
    for name in ("def overtake_left(", "def wait(", "def lead_closer_than(", "def feet("):
        assert name in library
    assert check_source(write([step]), library).passed


def test_one_skill_twice_is_told_apart_by_its_number() -> None:
    first, second = DialectStep("drive_at", Number(20.0)), DialectStep("drive_at", Number(60.0, "mph"))
    library = linked(first, second).library
    assert "def drive_at_1():" in library
    assert "def drive_at_2():" in library
    assert check_source(write([first, second]), library).passed


def test_what_the_road_does_not_allow_is_declined_in_words() -> None:
    found = link([DialectStep("turn_left")], HIGHWAY, LAMPILOT_LIMITS, lambda _: Leaning())
    assert isinstance(found, Declined)
    assert "junction" in found.words
