"""Driving a trip of a study with people, in simulation: the same loop as `chauffeur drive`, behind a letter."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from pathlib import Path

from chauffeur.bench.personalization.baseline import KeywordParameters
from chauffeur.bench.personalization.people import PeopleStudy
from chauffeur.bench.personalization.protocol import PlannedTrip
from chauffeur.bench.personalization.ride import ReadOnly
from chauffeur.bench.personalization.scenes import DRIVE_S, scenes_of
from chauffeur.concept import NOBODY, Limits
from chauffeur.drive.loop import LoopMemory
from chauffeur.drive.recording import RecordedTrip, write_trip
from chauffeur.drive.session import Forgetful, Session, parse_wish
from chauffeur.memory.feedback import interpret_feedback
from chauffeur.planners.base import Planner
from chauffeur.planners.registry import make_planner
from chauffeur.planners.talk2drive.recent import RecentToo


@dataclass(frozen=True, slots=True)
class PeopleDriven:
    """What may be told of a trip.

    Attributes:
        words: What happened, without what would give the system away.
        file: Where it is recorded; None where nothing was driven.
    """

    words: str
    file: Path | None


def drive_trip(study: PeopleStudy, trip: PlannedTrip, words: str, planner: str) -> PeopleDriven:
    """Drive a wish with the system behind the trip's letter.

    Raises:
        ChauffeurError: The wish is no wish, the key does not fit, or no plan could be had.
    """
    arm = study.system(trip)
    driver: Planner = KeywordParameters() if arm == "keyword" else make_planner(planner)
    memory: LoopMemory = Forgetful()
    person = NOBODY
    if arm == "with":
        person = study.person(trip.participant)
        learns = RecentToo(study.memory())
        memory = learns if trip.phase == "learning" else ReadOnly(learns)
    scene = next(scene for scene in scenes_of(trip.task) if scene.id == trip.scene)
    session = Session(driver, memory, max_s=DRIVE_S[trip.task])
    recorded = asyncio.run(session.drive(parse_wish(words, person), scene, scene.seed, Limits()))
    if not recorded.frames:
        return PeopleDriven("the car declined and goes on as it was.", None)
    path = study.trips_folder / trip.participant / f"{trip.number:03d}.mcap"
    write_trip(path, recorded.trip, recorded.frames, recorded.scenario, system=recorded.system, final=recorded.final)
    return PeopleDriven(_told(recorded), path)


def tell_memory(study: PeopleStudy, trip: PlannedTrip, comment: str) -> bool:
    """Hand what a person said after a learning trip to their profile; False where the trip was not driven here."""
    if trip.phase != "learning":
        return False
    memory = study.memory()
    return bool(memory.attach_feedback(study.person(trip.participant), interpret_feedback(comment)))


def _told(recorded: RecordedTrip) -> str:
    frames = recorded.frames
    speeds = [frame.observation.ego.speed_mps for frame in frames]
    return (
        f"{recorded.trip.duration_s:.0f} s, from {speeds[0]:.1f} m/s to {speeds[-1]:.1f} m/s, "
        f"{min(speeds):.1f} m/s to {max(speeds):.1f} m/s on the way."
    )
