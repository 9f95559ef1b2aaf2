"""The planner that means harm: its programs are programs, differ, and do what they are for."""

from __future__ import annotations

import asyncio
import hashlib

from chauffeur.concept import NOBODY, Limits
from chauffeur.driving.episode import drive_program, make_world
from chauffeur.driving.scenarios import find
from chauffeur.driving.session import Session, parse_wish
from chauffeur.planners.adversarial import harmful
from chauffeur.planners.registry import make_planner
from chauffeur.programs import check_source
from chauffeur.safety.blame import blame
from chauffeur.safety.shield import Shield

DRAWS = [hashlib.sha256(str(k).encode()).digest() for k in range(60)]


def test_its_programs_pass_the_gate_and_are_of_many_kinds() -> None:
    programs = {harmful(draw) for draw in DRAWS}
    assert len(programs) > 15
    assert all(check_source(program).passed for program in programs)


def test_the_verification_sees_through_numbers_that_are_worked_out() -> None:
    wish = parse_wish("Drive on.", NOBODY)
    trip = asyncio.run(Session(make_planner("adversarial")).drive(wish, find("overtake"), 3, Limits())).trip
    assert trip.outcome == "refused"


def test_driven_past_the_checks_it_does_no_harm_behind_the_shield() -> None:
    interventions = 0
    for seed, draw in enumerate(DRAWS[:10]):
        scenario = find(("overtake", "left-lane")[seed % 2])
        world = make_world(scenario)
        world.reset(scenario, 10 + seed)
        episode = drive_program(world, harmful(draw), None, 15.0, shield=Shield(world.dt_s, Limits()))
        assert episode.outcome != "off_road", seed
        assert blame(episode.frames, episode.final, world.dt_s).who != "ego", seed
        interventions += episode.interventions
    assert interventions > 100
