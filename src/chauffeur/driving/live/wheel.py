"""The person at the wheel: who has it, and what keys mean, as control hears it from a ring that nobody else reads.

A key is a wish of the person, for the world's own driver: limits, gap and shield stay as they are. Every message says
who has the wheel, so that none may be missed; keys that come late are not meant for now, and are passed over.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import Final

from chauffeur.concept import STOP_ZONE_M, Observation, Setpoints
from chauffeur.concept.units import MPS_PER_KMH
from chauffeur.driving.live.messages import Key, MessageError, WheelHand
from chauffeur.driving.live.ring import Reader, Ring
from chauffeur.worlds.base import EGO, Perception

STEP_MPS: Final = 5.0 * MPS_PER_KMH
"""What a key changes the speed by: 5 km/h, or less where the limit is low."""
_STEPS: Final = 6.0
"""So many steps at least lead from a stand to the speed limit."""
MEANT_WITHIN_NS: Final = 1_000_000_000
"""A key that was pressed longer ago, by the clock, is not meant for now."""
_STANDING_MPS: Final = 0.5


class Wheel:
    """Who has the wheel."""

    def __init__(self, hand: Ring, clock_ns: Callable[[], int] = time.monotonic_ns) -> None:
        """Args: the ring; the clock of all processes."""
        self._heard = Reader(hand, old=True)
        self._clock_ns = clock_ns
        self.handovers = 0
        """How often it has changed hands: odd while the person has it."""

    @property
    def taken(self) -> bool:
        """Whether the person has it."""
        return self.handovers % 2 == 1

    def hear(self, refused: Counter[str]) -> tuple[Key, ...]:
        """Who has the wheel now, and what they pressed since they took it, oldest first.

        Args:
            refused: Counts messages that are none, by reason.
        """
        keys: tuple[Key, ...] = ()
        for message in self._heard.news()[0]:
            try:
                hand = WheelHand.decode(message.payload)
            except MessageError as error:
                refused[str(error)] += 1
                continue
            if hand.on != self.taken:
                self.handovers += 1
                keys = ()
            if hand.on and hand.key is not None and self._clock_ns() - message.written_ns <= MEANT_WITHIN_NS:
                keys = (*keys, hand.key)
        return keys


def pressed(key: Key, setpoints: Setpoints, observation: Observation, perception: Perception) -> tuple[Setpoints, str]:
    """The person's wishes after a key, and what there is to tell them; empty where it was just done.

    Args:
        key: What they pressed.
        wishes: Theirs so far, settled.
        observation: The instant.
        perception: Of the same instant.
    """
    speed = max(0.0, observation.ego.speed_mps)
    wished = speed if setpoints.target_speed_mps is None else setpoints.target_speed_mps
    match key:
        case "faster":
            if speed < _STANDING_MPS:
                setpoints = _past_the_sign(setpoints, perception)
            return replace(setpoints, target_speed_mps=max(wished, speed) + _step(observation, perception)), ""
        case "slower":
            return replace(
                setpoints, target_speed_mps=max(0.0, min(wished, speed) - _step(observation, perception))
            ), ""
        case "brake":
            return replace(setpoints, target_speed_mps=0.0), ""
        case "left":
            return _aside(-1, setpoints, observation, perception)
        case "right":
            return _aside(1, setpoints, observation, perception)


def _step(observation: Observation, perception: Perception) -> float:
    lane = observation.ego.lane
    return min(STEP_MPS, (math.inf if lane is None else perception.speed_limit(lane)) / _STEPS)


def _past_the_sign(setpoints: Setpoints, perception: Perception) -> Setpoints:
    """Whoever goes on from a stand at a stop sign has stopped at it."""
    sign = perception.stop_sign_ahead(setpoints.served_stops)
    if sign is None or sign[1] > STOP_ZONE_M:
        return setpoints
    return replace(setpoints, served_stops=setpoints.served_stops | {sign[0]})


def _aside(side: int, setpoints: Setpoints, observation: Observation, perception: Perception) -> tuple[Setpoints, str]:
    """One lane to a side (left is -1); a turn, where a crossing is ahead and there is no lane."""
    name = "left" if side < 0 else "right"
    here = setpoints.target_lane or perception.lane_of(EGO)
    lane = perception.adjacent_lane(here, side)
    if lane is None:
        if observation.road.junctions:
            return replace(setpoints, turn=name), ""
        return setpoints, f"There is no lane to the {name}."
    there = observation.road.get(lane)
    if there is not None and there.closed and not there.emergency:
        return setpoints, f"The lane to the {name} ends."
    return replace(setpoints, target_lane=lane), ""
