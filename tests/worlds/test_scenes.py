"""Scenes as they are placed: as recorded from highway-env, and as that package itself places them now."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import highway_oracle
from chauffeur.worlds.highway.core import CoreRoad
from chauffeur.worlds.highway.network import LaneNetwork, StraightLane, lane_id
from chauffeur.worlds.highway.roads import build_scene, parse_config

GOLDEN = json.loads((Path(__file__).parent / "golden_scenes.json").read_text(encoding="utf-8"))
"""Recorded from the builder on highway-env 1.12.1: configurations, and by seed the digest of the placed scene."""


def digest(config: dict[str, Any], seed: int) -> str:
    """Of road and entities, to a micrometre: NumPy's sine differs between machines in the last bit."""
    scene = build_scene(parse_config(config, "golden"), np.random.default_rng(seed))
    core = CoreRoad.of(scene)
    emergency = [key for key in core.road.keys if lane_id(key) in scene.emergency_lanes]
    found = hashlib.sha256(repr((scene.kind, core.road.keys, emergency)).encode())
    for array in (core.floats, core.ints, core.scene, core.road.lanes, core.road.traits, core.road.roads):
        found.update((np.round(array.astype(np.float64), 6) + 0.0).tobytes())
    return found.hexdigest()[:16]


@pytest.mark.parametrize("name", GOLDEN)
def test_scenes_are_placed_as_recorded(name: str) -> None:
    config, digests = GOLDEN[name]["config"], GOLDEN[name]["digests"]
    assert {seed: digest(config, int(seed)) for seed in digests} == digests


def _rows(position: Any, *others: Any) -> tuple[float, ...]:
    return (*map(float, position), *map(float, others))


CONFIGS = st.one_of(
    st.fixed_dictionaries(
        {
            "type": st.just("ramp-merge-v0"),
            "vehicles_count": st.integers(0, 40),
            "vehicles_density": st.floats(0.2, 2.0),
            "stage_length": st.just([300.5, 70.25, 90.0, 1500.0]),
        }
    ),
    st.fixed_dictionaries(
        {
            "type": st.just("dt-highway-v0"),
            "vehicles_count": st.integers(0, 40),
            "num_lanes": st.integers(2, 6),
            "emergency_lane": st.booleans(),
        }
    ),
    st.fixed_dictionaries(
        {
            "type": st.just("dt-intersection-v0"),
            "num_vehicles_left": st.integers(0, 12),
            "num_vehicles_right": st.integers(0, 12),
            "spawn_probability_left": st.floats(0.0, 1.0),
            "speed_deviation_right": st.floats(0.0, 2.0),
        }
    ),
)


@given(CONFIGS, st.integers(0, 2**40))
@settings(max_examples=60, deadline=None)
def test_scenes_equal_highway_envs_to_the_bit(config: dict[str, Any], seed: int) -> None:
    ours, theirs = np.random.default_rng(seed), np.random.default_rng(seed)
    scene, oracle = (
        build_scene(parse_config(config, "x"), ours),
        highway_oracle.build_scene(parse_config(config, "x"), theirs),
    )
    assert ours.bit_generator.state == theirs.bit_generator.state
    cars = [car for car in oracle.road.vehicles if car is not oracle.ego]
    assert [
        (_rows(car.position, car.heading_rad, car.speed_mps, car.exponent, car.timer_s), car.lane, car.route)
        for car in scene.traffic
    ] == [
        (
            _rows(car.position, car.heading, car.target_speed, car.DELTA, car.timer),
            _name(car.lane_index),
            tuple((str(leg[0]), str(leg[1])) for leg in car.route or ()),
        )
        for car in cars
    ]
    fixed = [(scene.ego, oracle.ego), *zip(scene.objects, oracle.road.objects, strict=True)]
    for entity, expected in fixed:
        assert _rows(entity.position, entity.heading_rad, entity.speed_mps, *entity.size_m) == _rows(
            expected.position, expected.heading, expected.speed, expected.LENGTH, expected.WIDTH
        )
        assert entity.lane == _name(expected.lane_index)
    for name, lane in scene.network.lanes().items():
        expected = oracle.road.network.get_lane(name)
        for s in (0.0, 0.3 * lane.length, lane.length):
            assert tuple(lane.position(s, 0.7)) == tuple(expected.position(s, 0.7))
            assert lane.heading_at(s) == expected.heading_at(s)
        assert (lane.length, lane.speed_limit, lane.forbidden, lane.priority) == (
            expected.length,
            expected.speed_limit,
            expected.forbidden,
            expected.priority,
        )


def _name(index: Any) -> tuple[str, str, int]:
    return str(index[0]), str(index[1]), int(index[2])


def test_the_shortest_way_is_found_and_none_is_empty() -> None:
    network = LaneNetwork()
    for start, end in (("a", "b"), ("b", "d"), ("a", "c"), ("c", "d"), ("d", "e"), ("b", "a")):
        network.add(start, end, StraightLane([0, 0], [1, 0], speed_limit=10))
    assert network.shortest_path("a", "e") == ["a", "b", "d", "e"]
    assert network.shortest_path("e", "a") == []
    assert network.shortest_path("a", "x") == []
