"""Items: commands with the style that is meant, and the gains that styles stand for."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from functools import cache
from typing import Any, Final, Literal
from zlib import crc32

import numpy as np

from chauffeur.concept import CameraImage, Context, DataError, Scenario
from chauffeur.concept.data import read_data
from chauffeur.concept.weather import WEATHERS, Weather
from chauffeur.driving.seat import SeatCamera
from chauffeur.driving.surroundings import SKY
from chauffeur.planners.vlm.template import STYLES, Style
from chauffeur.worlds.track import TrackWorld, track_scenario
from chauffeur.worlds.track.dynamics import Plant
from chauffeur.worlds.track.manoeuvres import MANOEUVRES, ManoeuvreName

Told = Literal["told", "hidden", "wrong"]
"""Weather told to a planner: as it is, nothing, or that of another weather (a control)."""

Shown = Literal["off", "on", "black", "other"]
"""Picture shown to a planner: no picture, the front camera's, a black one, or one of another weather (controls)."""
_PLACES: Final = 7 << 21
"""First seed of the places: none of them is one that a model of ours was trained on."""

TASK: Final[dict[ManoeuvreName, str]] = {
    "acceleration": "The manoeuvre is to accelerate to 50 km/h behind the vehicle ahead.",
    "lane_change": "The manoeuvre is to change to the left lane at 50 km/h, past the vehicle ahead.",
    "left_turn": "The manoeuvre is a left turn with a radius of 24 m at 30 km/h.",
}
_OTHER: Final[dict[Weather, Weather]] = {
    "sunny": "snow", "rain": "sunny", "fog": "sunny", "snow": "sunny", "night": "sunny",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class MotionCommand:
    """A passenger's command about a manoeuvre.

    Attributes:
        id: E.g. `left_turn.c03`.
        manoeuvre: Which.
        style: What is meant.
        directness: 1 said outright, 2 indirect, 3 a mere reason (paper Tab. VII).
        text: The words.
    """

    id: str
    manoeuvre: ManoeuvreName
    style: Style
    directness: int
    text: str


@dataclass(frozen=True, slots=True)
class MotionItem:
    """A command in a weather."""

    command: MotionCommand
    weather: Weather
    plant: Plant
    seed: int

    @property
    def id(self) -> str:
        """E.g. `left_turn.c03.snow`."""
        return f"{self.command.id}.{self.weather}"

    @property
    def scenario(self) -> Scenario:
        """Place where it is driven."""
        return track_scenario(self.command.manoeuvre, self.weather, self.plant, self.seed)

    def shown(self, shown: Shown) -> tuple[CameraImage, ...]:
        """V: the front camera at the start, rendered; a place of its own for each command.

        Raises:
            ChauffeurError: The scene cannot be set up or rendered.
        """
        if shown == "off":
            return ()
        world = TrackWorld()
        observation = world.reset(self.scenario)
        weather = _OTHER[self.weather] if shown == "other" else self.weather
        place = _PLACES + crc32(f"{self.seed}/{self.command.id}".encode()) % (1 << 20)
        images = SeatCamera(world, place, weather).take(observation)
        if shown != "black":
            return images
        return tuple(CameraImage(one.camera, one.time_s, np.zeros_like(one.pixels())) for one in images)

    def told(self, context: Context, told: Told) -> Context:
        """C with the manoeuvre, and with what is told of the weather."""
        sky = {"told": SKY[self.weather], "hidden": "", "wrong": SKY[_OTHER[self.weather]]}[told]
        text = " ".join(part for part in (context.text, TASK[self.command.manoeuvre], sky) if part)
        return Context(text, context.situation)


@cache
def commands() -> tuple[MotionCommand, ...]:
    """All commands. Raises DataError: the file is not here or damaged."""
    found: list[MotionCommand] = []
    for number, line in enumerate(read_data("motion", "commands.jsonl").splitlines(), start=1):
        try:
            one = MotionCommand(**json.loads(line))
        except (ValueError, TypeError) as error:
            raise DataError(f"commands.jsonl, line {number}: {error}.", hint="See data/motion/CARD.md.") from error
        if one.manoeuvre not in MANOEUVRES or one.style not in STYLES or one.directness not in (1, 2, 3):
            raise DataError(f"commands.jsonl, line {number}: unknown manoeuvre, style or directness.")
        found.append(one)
    return tuple(found)


@cache
def style_ranges() -> dict[str, dict[str, tuple[float, float]]]:
    """Range of each gain (`kp` ... `ws`) of each style. Raises DataError: the file is not here or damaged."""
    try:
        ranges: Any = json.loads(read_data("motion", "styles.json"))["ranges"]
        return {
            style: {name: (float(low), float(high)) for name, (low, high) in ranges[style].items()} for style in STYLES
        }
    except (ValueError, KeyError, TypeError) as error:
        raise DataError(f"styles.json cannot be read: {error!r}.", hint="See data/motion/CARD.md.") from error


def data_sha256() -> str:
    """Hash of the commands and styles."""
    return hashlib.sha256(read_data("motion", "commands.jsonl") + read_data("motion", "styles.json")).hexdigest()


def motion_items(plant: Plant, seed: int) -> tuple[MotionItem, ...]:
    """Every command in every weather."""
    return tuple(MotionItem(command, weather, plant, seed) for command in commands() for weather in WEATHERS)
