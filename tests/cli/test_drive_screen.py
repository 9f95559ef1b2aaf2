"""The screen of a drive: outcome first, the passenger's units, one decision on what deserves a tick."""

from __future__ import annotations

import asyncio
import io
import os
import subprocess
import sys
from dataclasses import replace

import pytest
from rich.console import Console

from chauffeur.cli.compilation import CompilationNotice
from chauffeur.cli.parts import planner_named
from chauffeur.cli.show import FullTeller, Teller
from chauffeur.concept import Instruction, Limits, Program, Verdict
from chauffeur.driving.judge.choice import referee_for
from chauffeur.driving.recording import RecordedTrip
from chauffeur.driving.scenarios import find
from chauffeur.driving.session import Session
from chauffeur.hmi import words


def screen(teller: type[Teller], wish: str, name: str, width: int = 80) -> tuple[str, RecordedTrip]:
    written = io.StringIO()
    shown = teller(Console(file=written, width=width, highlight=False))
    place = find(name)
    session = Session(planner_named("onboard", None), referee=referee_for, tell=shown.tell)
    shown.begin(place, place.seed)
    with shown:
        recorded = asyncio.run(session.drive(Instruction(wish), place, place.seed, Limits()))
    shown.end(recorded)
    return written.getvalue(), recorded


def test_the_outcome_comes_first_then_thoughts_and_program_in_the_passengers_units() -> None:
    told, _ = screen(Teller, "Overtake and come back.", "overtake")
    lines = [line.rstrip() for line in told.splitlines()]
    assert lines[0].startswith("✓ Done after ")
    account = " ".join(line.strip() for line in lines[1:3])
    understood = "pass the vehicle ahead, then change back to the original lane"
    assert account == f"You asked “Overtake and come back.”; I understood: {understood}; done: all of it."
    assert lines[3].strip().startswith("Past the vehicle ahead, back in the lane where it began, speed ")
    places = [next(i for i, line in enumerate(lines) if word in line) for word in ("Road", "Thoughts", "Program")]
    assert places == sorted(places)
    assert "def drive():" in told and "def overtake_and_return" not in told
    assert "113 km/h" in told and "m/s" not in told and "seed" not in told and "score" not in told
    assert all(len(line) <= 80 for line in lines)


def test_everything_is_there_for_those_who_ask() -> None:
    told, recorded = screen(FullTeller, "Overtake and come back.", "overtake", width=120)
    for word in ("def overtake_and_return", "31.29 m/s", "seed 17", "Driving score", recorded.trip.id, "sha256"):
        assert word in told, word


def test_a_person_who_says_mph_reads_mph() -> None:
    told, _ = screen(Teller, "Slow down to 55 mph.", "cruise")
    assert "55 mph" in told and "km/h" not in told


def test_only_what_was_shown_to_be_right_gets_a_tick() -> None:
    assert words.MARKS[Verdict("reach-v1", True, "").mark] == "✓"
    assert words.MARKS[Verdict("reach-v1", True, "Not proven: a speed.", proven=False).mark] != "✓"
    assert words.MARKS[Verdict("alignment-v1", False, "", vetoes=False).mark] == "≠"
    assert words.MARKS[Verdict("format-v1", False, "").mark] == "✕"
    told, recorded = screen(Teller, "Overtake and come back.", "overtake")
    open_check = next(verdict for verdict in recorded.trip.verdicts if not verdict.proven)
    assert f"~ {words.check_name(open_check.check)}, not all proven" in told


def test_done_is_not_ticked_beside_an_explanation_that_was_not_kept() -> None:
    _, recorded = screen(Teller, "Drive at 100 km/h.", "overtake")
    mistold = next(verdict for verdict in recorded.trip.verdicts if verdict.check.startswith("alignment-driven"))
    assert not mistold.passed
    done = replace(recorded.trip, outcome="success")
    sign, label, tone = words.trip_words(done)
    assert sign == "≠" and "not as explained" in label and tone != "good"


def test_the_line_that_runs_is_followed_into_helper_functions() -> None:
    _, recorded = screen(Teller, "Overtake and come back.", "overtake")
    policy = recorded.trip.plan.policy
    assert isinstance(policy, Program)
    shown = policy.text.splitlines()
    lines = {frame.line for frame in recorded.frames if frame.program == "running" and frame.line is not None}
    assert all("yield" in shown[line - 1] for line in lines)
    assert len(lines) > 1 and all(line > policy.source.count("\n") for line in lines), "not the line of drive() alone"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("at 23.66 m/s where 31.29 m/s are allowed", "at 85 km/h where 113 km/h are allowed"),
        ("up to 31.29 m/s (70 mph, 113 km/h), until", "up to 113 km/h, until"),
        ("brakes with 2.5 m/s2, then 3 m/s²", "brakes with 2.5 m/s2, then 3 m/s²"),
        ("32.63 m away, 15 m more", "33 m away, 15 m more"),
        ("1.0 s behind", "1.0 s behind"),
    ],
)
def test_numbers_for_the_passenger(text: str, told: str) -> None:
    assert words.passenger_units(text) == told


def test_units_are_read_in_linear_time() -> None:
    for worst in ("9" * 200_000, "1." * 100_000, "9 m/s (" * 30_000, "1.1 m" * 40_000):
        words.passenger_units(worst)  # a quadratic pattern takes minutes


def test_compiling_is_told_once_and_only_while_it_is_done() -> None:
    told: list[tuple[int, int]] = []
    with CompilationNotice(lambda done, of: told.append((done, of))):
        pass
    assert told == []
    script = (
        "import numba\n"
        "import chauffeur.safety.shield.compiled as here\n"
        "here.twice = numba.njit(lambda x: 2 * x)\n"
        "from chauffeur.cli.compilation import CompilationNotice\n"
        "told = []\n"
        "with CompilationNotice(lambda done, of: told.append((done, of))):\n"
        "    here.twice(1), here.twice(2)\n"
        "here.twice(1.5)\n"
        "print([done for done, of in told], all(of > 1 for done, of in told))\n"
    )
    run = [sys.executable, "-c", script]
    done = subprocess.run(run, capture_output=True, text=True, check=True, timeout=600, env=dict(os.environ))
    assert done.stdout.strip() == "[0, 1] True", done.stderr
