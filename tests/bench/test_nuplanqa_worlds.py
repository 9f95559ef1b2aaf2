"""Scenes of the worlds: what is read of an observation is what is there, and the splits share nothing."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from chauffeur.bench.nuplanqa.scenes.facts import FAMILIES, facts_of, sighted
from chauffeur.bench.nuplanqa.scenes.reading import motion_of, read_scene
from chauffeur.bench.nuplanqa.scenes.scene import SAMPLES, QaScene
from chauffeur.bench.nuplanqa.scenes.staging import stage
from chauffeur.bench.nuplanqa.scenes.wording import word_bank
from chauffeur.bench.nuplanqa.scenes.worlds import world_scene
from chauffeur.bench.openloop.driving import TOWNS, UNSEEN_TOWN, Place
from chauffeur.geometry.box import overlap

PLACES: tuple[Place, ...] = ("highway", "crossing", "lot", "town")


def drawn(place: Place, number: int, *, test: bool = False) -> QaScene:
    return world_scene(f"{number:016x}", place, number, test, np.random.default_rng([3, number]))


def read(staged: QaScene) -> QaScene | None:
    """A staged scene read from its observations alone."""
    lane = f"own.{staged.own}"
    instants = [replace(one, ego=replace(one.ego, lane=lane)) for one in staged.instants]
    return read_scene(instants, staged.token, "", staged.sky, (0.0,) * SAMPLES)


def test_what_is_read_of_a_staged_scene_is_what_was_staged() -> None:
    both: dict[str, int] = {}
    for number in range(160):
        staged = stage(f"{number:016x}", np.random.default_rng([11, number]))
        found = read(staged)
        if found is None:
            continue
        seen = sighted(staged)
        truth = {(fact.family, fact.side): fact.value for fact in facts_of(staged, seen)}
        for fact in facts_of(found, seen):
            if (fact.family, fact.side) in truth:
                assert truth[fact.family, fact.side] == fact.value, (number, fact)
                both[fact.family] = both.get(fact.family, 0) + 1
    assert set(both) == set(FAMILIES) and min(both.values()) >= 5, both


@pytest.mark.parametrize("place", PLACES)
def test_a_scene_of_a_world_is_the_same_again_and_can_be_asked_about(place: Place) -> None:
    one, again = drawn(place, 4), drawn(place, 4)
    assert one.instants == again.instants and motion_of(one.instants) == one.motion
    facts = list(facts_of(one, sighted(one)))
    assert facts and all(fact.value in word_bank().families[fact.family].classes for fact in facts)
    assert one.source.startswith(place) and one.scene_type.startswith("simulated ")


def test_the_test_splits_town_is_in_no_other() -> None:
    assert drawn("town", 0, test=True).source == f"town {UNSEEN_TOWN}"
    assert drawn("town", 2).source.removeprefix("town ") in TOWNS and UNSEEN_TOWN not in TOWNS


def test_vehicles_of_the_highway_are_of_many_kinds_where_there_is_room() -> None:
    kinds: set[str] = set()
    for number in range(8):
        for instant in drawn("highway", number).instants:
            near = [one for one in (instant.ego, *instant.others) if abs(one.x_m - instant.ego.x_m) < 150.0]
            for one in near:  # cars may: a start is moved back at constant speeds
                assert one.kind == "car" or not any(overlap(one.box, two.box) for two in near if two is not one)
            kinds |= {one.kind for one in instant.others}
    assert kinds == {"car", "truck", "bus", "motorcycle"}


def test_who_is_ahead_on_the_highway_is_whom_the_world_names() -> None:
    told = 0
    for number in range(12):
        scene = drawn("highway", number)
        front = scene.now.front
        if scene.lead is not None and front is not None and "lead" not in scene.unclear:
            assert scene.lead.id == front.vehicle and scene.lead.ahead_m == pytest.approx(front.distance_m, abs=0.5)
            told += 1
    assert told >= 3


def test_fast_scenes_are_asked_nothing_that_their_speed_tells() -> None:
    scene = next(one for one in (drawn("highway", number) for number in range(20)) if one.fast)
    asked = {fact.family for fact in facts_of(scene, sighted(scene))}
    known = {fact.family for fact in facts_of(scene, sighted(scene), asked=False)}
    assert asked < known and asked.isdisjoint({"layout", "light", "situation", "lanes"})
    assert math.isfinite(max(scene.speeds_mps))
