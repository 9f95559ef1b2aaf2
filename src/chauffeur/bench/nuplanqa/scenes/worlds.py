"""Scenes taken from the worlds: highway, crossing, town and parking lot, each driven by its own driver.

Splits share no seed, and the town of the test split is in no other. Of the highway's scenes half show the start of a
trip, as a benchmark's instruction meets it: the moment before is that of constant speeds. The highway's simulator has
cars of one kind; where there is room, some are drawn as trucks, buses and motorcycles.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any, Final

import numpy as np

from chauffeur.bench.nuplanqa.scenes.reading import motion_of, read_scene
from chauffeur.bench.nuplanqa.scenes.scene import SAMPLES, SKIES, STEP_S, QaScene, Sky
from chauffeur.bench.nuplanqa.scenes.staging import SHAKE_RAD, SIZES
from chauffeur.bench.openloop.driving import TOWNS, UNSEEN_TOWN, Place, TrafficTrip, instants
from chauffeur.concept import ScenarioError
from chauffeur.concept.scene import AgentKind, Observation
from chauffeur.describe.vision import rewound
from chauffeur.geometry.box import overlap

SECONDS: Final[dict[Place, float]] = {"town": 40.0, "highway": 20.0, "crossing": 20.0, "lot": 20.0}
CLIPS: Final = 2
"""Scenes of one trip in town, whose simulator takes its time."""
_APART: Final = 10
"""Instants between two of them, at least."""
_TRIES: Final = 40
_DRESSED: Final[tuple[AgentKind, ...]] = ("car", "car", "truck", "bus", "motorcycle")
_SPARE_M: Final = 1.0
_START_SHARE: Final = 0.5
_SLOW_SHARE: Final = 0.3


def world_scene(token: str, place: Place, number: int, test: bool, rng: np.random.Generator) -> QaScene:
    """A scene of a world.

    Args:
        token: Its name.
        place: Which world.
        number: Of the scenes of this world; `CLIPS` of the town's in a row are of one trip.
        test: Whether it is of the test split, which has a town of its own.
        rng: Draws everything.

    Raises:
        ScenarioError: No trip has a moment that can be asked about.
        MissingExtraError: The town's simulator is not installed.
    """
    for attempt in range(_TRIES):
        if place == "town":
            town = UNSEEN_TOWN if test else TOWNS[number // CLIPS % len(TOWNS)]
            clips = _town_clips(town, int(test), number // CLIPS, attempt)
            clip = clips[number % CLIPS] if len(clips) > number % CLIPS else None
            source = f"town {town}"
        else:
            clip, source = _clip(place, int(rng.integers(2**31)), rng), place
        if clip is None:
            continue
        sky: Sky = SKIES[int(rng.integers(len(SKIES)))]
        scene = read_scene(clip, token, source, sky, rng.normal(0.0, SHAKE_RAD, SAMPLES).tolist())
        if scene is not None:
            return scene
    raise ScenarioError(f"None of {_TRIES} trips of the {place} has a moment that can be asked about.")


def _clip(place: Place, seed: int, rng: np.random.Generator) -> tuple[Observation, ...] | None:
    """Five instants of a trip."""
    config = _highway(rng) if place == "highway" else None
    trip = TrafficTrip(f"{place}-{seed}", place, "", seed, SECONDS[place], config)
    moments = instants(trip)
    try:
        if place == "highway" and rng.random() < _START_SHARE:
            first = next(moments).observation
            ago = [STEP_S * (SAMPLES - 1 - at) for at in range(SAMPLES)]
            return dressed([rewound(first, one) if one else first for one in ago], rng)
        seen = [one.observation for one in moments]
    except ScenarioError:  # a start that cannot be
        return None
    found = next(_windows(seen, rng), None)
    return dressed(found, rng) if place == "highway" and found is not None else found


def _windows(seen: Sequence[Observation], rng: np.random.Generator) -> Iterator[tuple[Observation, ...]]:
    """Clips of a trip in which it is clear how the ego moves, of one kind of motion after another, in random order."""
    by_motion: dict[str, list[int]] = {}
    for last in range(SAMPLES - 1, len(seen)):
        motion = motion_of(seen[last - SAMPLES + 1 : last + 1])
        if motion is not None:
            by_motion.setdefault(motion, []).append(last)
    taken: list[int] = []
    while by_motion:
        motions = sorted(by_motion)
        motion = motions[int(rng.integers(len(motions)))]
        places = by_motion[motion]
        last = places.pop(int(rng.integers(len(places))))
        if not places:
            del by_motion[motion]
        if all(abs(last - other) >= _APART for other in taken):
            taken.append(last)
            yield tuple(seen[last - SAMPLES + 1 : last + 1])


@lru_cache(maxsize=2)
def _town_clips(town: str, split: int, trip: int, attempt: int) -> tuple[tuple[Observation, ...], ...]:
    """Clips of a trip in town that can be asked about, `CLIPS` at most."""
    seeds = np.random.SeedSequence([split, trip, attempt])
    rng = np.random.default_rng(seeds)
    seed = int(seeds.generate_state(1)[0] >> 1)
    try:
        seen = [one.observation for one in instants(TrafficTrip(f"town-{seed}", "town", town, seed, SECONDS["town"]))]
    except ScenarioError:
        return ()
    found: list[tuple[Observation, ...]] = []
    for clip in _windows(seen, rng):
        if read_scene(clip, "", "", "clear day", (0.0,) * SAMPLES) is not None:
            found.append(clip)
        if len(found) == CLIPS:
            break
    return tuple(found)


def _highway(rng: np.random.Generator) -> dict[str, Any]:
    """A highway as LaMPilot's scenes have them: from nearly empty to dense, with a ramp or without."""
    speed = float(rng.uniform(8.0, 13.0) if rng.random() < _SLOW_SHARE else rng.uniform(20.0, 32.0))
    config: dict[str, Any] = {
        "vehicles_count": int(rng.integers(8, 60)),
        "vehicles_density": float(rng.uniform(0.1, 1.2)),
        "redraw_unfit": True,
    }
    if rng.random() < 0.5:
        ego = {"speed": speed, "start_lane_index": ["c", "d", int(rng.integers(2))], "start_position": [105, 0]}
        return {**config, "type": "ramp-merge-v0", "stage_length": [500, 80, 80, 2000], "ego_vehicle": ego}
    lanes = int(rng.integers(2, 7))
    ego = {"speed": speed, "start_lane_index": ["a", "b", int(rng.integers(lanes))], "start_position": [105, 0]}
    return {**config, "type": "dt-highway-v0", "num_lanes": lanes, "stage_length": [2000], "ego_vehicle": ego}


def dressed(clip: Sequence[Observation], rng: np.random.Generator) -> tuple[Observation, ...]:
    """The clip with some cars drawn as other kinds of vehicles, where these have room at every instant."""
    sizes: dict[int, tuple[AgentKind, float, float]] = {}
    there = [{one.id: one.box for one in (instant.ego, *instant.others)} for instant in clip]
    for who in sorted({one.id for instant in clip for one in instant.others if one.kind == "car"}):
        kind = _DRESSED[int(rng.integers(len(_DRESSED)))]
        if kind == "car":
            continue
        length, width = SIZES[kind]
        grown = [None if who not in boxes else replace(boxes[who], length_m=length, width_m=width) for boxes in there]
        if any(
            overlap(box.grown(_SPARE_M), near)
            for box, boxes in zip(grown, there, strict=True)
            if box is not None
            for other, near in boxes.items()
            if other != who
        ):
            continue
        sizes[who] = (kind, length, width)
        for box, boxes in zip(grown, there, strict=True):
            if box is not None:
                boxes[who] = box

    def drawn(instant: Observation) -> Observation:
        others = tuple(
            one
            if one.id not in sizes
            else replace(one, kind=sizes[one.id][0], length_m=sizes[one.id][1], width_m=sizes[one.id][2])
            for one in instant.others
        )
        return replace(instant, others=others)

    return tuple(map(drawn, clip))
