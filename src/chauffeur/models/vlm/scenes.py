"""Pictures to learn from: the test track and the highway through the windscreen, with what is true of each.

A scene is drawn from a split and a number alone. Splits have places (buildings, trees, the sun), traffic and weather of
their own: a place of the tests is in no picture of training.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, Final, Literal, get_args

import numpy as np

from chauffeur.camera import (
    LOOKS,
    CameraImages,
    CameraLook,
    Conditions,
    Renderer,
    SemanticClass,
    front_rig,
    make_renderer,
)
from chauffeur.concept import DataError, Lead, Observation, Scenario, VehicleState
from chauffeur.concept.weather import WEATHERS
from chauffeur.driving.episode import make_world
from chauffeur.geometry import wrap_to_pi
from chauffeur.planners.camera_faults import CELLS, HEIGHT, WIDTH, small
from chauffeur.worlds.base import World
from chauffeur.worlds.highway.scenarios import BUILT_IN as ROADS
from chauffeur.worlds.track.manoeuvres import MANOEUVRES, ManoeuvreName, manoeuvre
from chauffeur.worlds.track.world import LENGTH_M, WIDTH_M

Split = Literal["train", "val", "test", "held_out_a", "held_out_b"]
SPLITS: Final[tuple[Split, ...]] = get_args(Split)
LIGHTEST, HEAVY_FROM = 0.3, 0.62
"""Grades of weather: the lightest that is drawn, and where it begins to be called heavy."""
_NEAR_M, _AHEAD_M, _FAR_M = 18.0, 40.0, 80.0
_BENDS_RAD: Final = 0.35
_IN_VIEW_RAD: Final = 0.55
_LOOK_M: Final = 38.0
_SIZES: Final = {"car": (4.6, 1.8), "truck": (8.5, 2.5), "bus": (11.5, 2.5)}
SHARD: Final = 500
"""Pictures in a file."""
_LENSES: Final = (-0.05, -0.03, -0.015, 0.0, 0.015, 0.03)
"""Radial distortion of training's lenses: less either way than that of the held-out looks."""
_VEHICLES: Final = (SemanticClass.CAR, SemanticClass.TRUCK, SemanticClass.BUS)

Pictures = np.ndarray[Any, np.dtype[np.uint8]]


@dataclass(frozen=True, slots=True)
class SceneFacts:
    """Facts of a picture, in the words of `planners.vlm.template`, and where it was taken."""

    weather: str
    grade: str
    lead: str
    road: str
    task: str
    place: str


@dataclass(frozen=True, slots=True)
class SeatScene:
    """A scene as it is drawn."""

    observation: Observation
    conditions: Conditions
    seed: int
    facts: SceneFacts


def seat_scene(split: Split, number: int) -> SeatScene:
    """The scene of a number of a split."""
    which = SPLITS.index(split)
    rng = np.random.default_rng([41, which, number])
    weather = WEATHERS[number % len(WEATHERS)]
    grade = float(rng.uniform(LIGHTEST, 1.0))
    conditions = Conditions.of(weather, grade)
    if rng.random() < 0.12:
        observation, task, road, place = _on_highway(rng, which)
    else:
        observation, task, road, place = _on_track(rng)
    facts = SceneFacts(
        weather,
        "clear" if weather == "sunny" else "heavy" if grade >= HEAVY_FROM else "light",
        _lead_of(observation, conditions.visibility_m),
        road,
        task,
        place,
    )
    return SeatScene(observation, conditions, int(rng.integers(1, 1 << 20)) + (which << 21), facts)


def _lead_of(observation: Observation, visibility_m: float) -> str:
    front = observation.front
    if front is None:
        return "no_lead"
    lead = next((one for one in observation.others if one.id == front.vehicle), None)
    ego = observation.ego
    if lead is not None:
        bearing = math.atan2(lead.y_m - ego.y_m, lead.x_m - ego.x_m) - ego.heading_rad
        if abs(wrap_to_pi(bearing)) > _IN_VIEW_RAD:
            return "no_lead"
    gap = front.distance_m - LENGTH_M
    if gap > min(_FAR_M, 0.8 * visibility_m):
        return "no_lead"
    return "near_lead" if gap < _NEAR_M else "lead" if gap < _AHEAD_M else "far_lead"


def _on_track(rng: np.random.Generator) -> tuple[Observation, str, str, str]:
    name: ManoeuvreName = MANOEUVRES[int(rng.integers(3))]
    plan = manoeuvre(name)
    station = float(rng.uniform(0.0, 62.0 if name == "left_turn" else 350.0))
    pose = plan.path.at(station)
    if name == "acceleration" and rng.random() < 0.4:  # also from the left lane
        pose = replace(pose, y_m=pose.y_m + 3.5)
    aside, turned = float(rng.normal(0.0, 0.2)), float(rng.normal(0.0, 0.015))
    x, y = pose.place(0.0, aside)
    speed = 0.0 if name == "acceleration" and rng.random() < 0.6 else float(rng.uniform(3.0, 14.0))
    place = plan.road.locate(x, y, pose.heading_rad)
    assert place is not None
    ego = VehicleState(0, "car", x, y, pose.heading_rad + turned, speed, LENGTH_M, WIDTH_M, place.lane)
    others: list[VehicleState] = []
    front = None
    if rng.random() < 0.75:
        kind: Any = ("car", "car", "car", "truck", "bus")[int(rng.integers(5))]
        length, width = _SIZES[kind]
        away = float(rng.choice((rng.uniform(9.0, 24.0), rng.uniform(18.0, 46.0), rng.uniform(40.0, 82.0))))
        away += (length - LENGTH_M) / 2.0
        if name == "left_turn":
            at = plan.path.at(min(station + away, plan.path.length_m))
            ax, ay, heading = at.x_m, at.y_m, at.heading_rad
        else:
            (ax, ay), heading = pose.place(away, 0.0), pose.heading_rad
            if name == "lane_change":
                ay = 0.0 if pose.y_m < 1.75 else 3.5
        lane = plan.road.locate(ax, ay, heading)
        lead_speed = float(rng.choice((0.0, rng.uniform(2.0, 12.0))))
        lead = VehicleState(
            1, kind, ax, ay, heading, lead_speed, length, width, lane.lane if lane else None,
            acceleration_mps2=float(rng.uniform(-2.0, 1.3)),
        )  # fmt: skip
        others.append(lead)
        front = Lead(1, away, lead_speed)
    if name != "left_turn":
        beside = 3.5 if pose.y_m < 1.75 else 0.0
        for i in range(int(rng.integers(0, 3))):
            ax = pose.x_m + float(rng.uniform(9.0, 90.0)) + 14.0 * i
            speed_ = float(rng.uniform(3.0, 14.0))
            others.append(VehicleState(2 + i, "car", ax, beside, 0.0, speed_, 4.6, 1.8, None))
    observation = Observation(
        time_s=0.0, tick=int(rng.integers(400)), kind="track", ego=ego, others=tuple(others), objects=(),
        road=plan.road, front=front, stop_sign_m=None, off_road=False, ended=False,
    )  # fmt: skip
    ahead = plan.path.at(min(station + _LOOK_M, plan.path.length_m)).heading_rad - pose.heading_rad
    road = "bend_left" if name == "left_turn" and ahead > _BENDS_RAD else "straight"
    return observation, name, road, f"track/{name}"


@cache
def _highway() -> tuple[World, tuple[Scenario, ...]]:
    names = ("overtake", "following", "cruise", "left-lane", "emergency-lane")
    roads = tuple(one for one in ROADS if one.id in names)
    return make_world(roads[0]), roads


def _on_highway(rng: np.random.Generator, which: int) -> tuple[Observation, str, str, str]:
    world, scenarios = _highway()
    scenario = scenarios[int(rng.integers(len(scenarios)))]
    observation = world.reset(scenario, int(rng.integers(1 << 16)) + (which << 17))
    task = "lane_change" if rng.random() < 0.6 else "acceleration"
    return observation, task, "straight", f"highway/{scenario.id}"


def look_of_training(number: int) -> CameraLook:
    """The look of a picture of training: `default` behind one of several lenses. Colours are varied as it is fed."""
    return CameraLook("training", distortion=_LENSES[int(np.random.default_rng([43, number]).integers(len(_LENSES)))])


def view_of(scene: SeatScene, renderer: Renderer, look: CameraLook = LOOKS["default"]) -> tuple[Pictures, Pictures]:
    """The picture of a scene as the model takes it, (HEIGHT, WIDTH, 3) uint8, and its `cells_of`."""
    taken = renderer.render(scene.observation, front_rig(), scene.conditions, scene.seed, look=look, truth=True)
    front = scene.observation.front
    return small(taken.images[0].pixels()), cells_of(taken, None if front is None else front.vehicle)


def cells_of(taken: CameraImages, lead: int | None) -> Pictures:
    """How much of each cell of a picture vehicles cover, and how much the lead vehicle does: (2, *CELLS) uint8."""
    truth = taken.truth[0]
    shown = np.zeros((2, *truth.classes.shape), np.float32)
    shown[0] = np.isin(truth.classes, _VEHICLES)
    for one in truth.sightings:
        if lead is not None and one.instance.id == lead and one.instance.kind in _SIZES:
            shown[1] = truth.instances == one.instance.number
    rows, columns = CELLS
    height, width = truth.classes.shape
    shares = shown.reshape(2, rows, height // rows, columns, width // columns).mean(axis=(2, 4))
    return np.ceil(shares * 255.0).astype(np.uint8)


def make_pictures(folder: Path, split: Split, count: int, told: Callable[[str, int, int], None]) -> None:
    """Render a split in files of `SHARD`; those that are there already stay.

    Args:
        folder: Where they go, e.g. `train-000.npz`.
        split: Which; the held-out ones have a palette, exposure and lens of their own.
        count: Pictures.
        told: Is told (stage, done, of how many).
    """
    folder.mkdir(parents=True, exist_ok=True)
    renderer: Renderer | None = None
    for start in range(0, count, SHARD):
        path = folder / f"{split}-{start // SHARD:03d}.npz"
        size = min(SHARD, count - start)
        if not path.exists():
            renderer = renderer or make_renderer()
            pixels = np.zeros((size, HEIGHT, WIDTH, 3), np.uint8)
            cells = np.zeros((size, 2, *CELLS), np.uint8)
            rows: list[str] = []
            for place in range(size):
                scene = seat_scene(split, start + place)
                look = look_of_training(start + place) if split == "train" else LOOKS.get(split, LOOKS["default"])
                pixels[place], cells[place] = view_of(scene, renderer, look)
                rows.append(_line(scene.facts))
            part = path.with_suffix(".part.npz")
            np.savez(part, pixels=pixels, cells=cells, facts=np.array(rows))
            part.replace(path)
        told(f"pictures, {split}", start + size, count)


def _line(facts: SceneFacts) -> str:
    return "\t".join(asdict(facts).values())


@dataclass(frozen=True, eq=False)
class PictureSet:
    """Pictures of a split in memory.

    Attributes:
        pixels: (N, HEIGHT, WIDTH, 3) uint8.
        cells: See `cells_of`, (N, 2, *CELLS).
        facts: What is true of each.
    """

    pixels: Pictures
    cells: Pictures
    facts: tuple[SceneFacts, ...]

    def __len__(self) -> int:
        """Number of them."""
        return len(self.facts)


def load_pictures(folder: Path, split: Split, count: int) -> PictureSet:
    """The first pictures of what `make_pictures` has made. Raises DataError: there are fewer, or a file is damaged."""
    pixels: list[Pictures] = []
    cells: list[Pictures] = []
    facts: list[SceneFacts] = []
    for path in _files(folder, split):
        try:
            with np.load(path, allow_pickle=False) as held:
                pixels.append(held["pixels"])
                cells.append(held["cells"])
                facts += [SceneFacts(*str(line).split("\t")) for line in held["facts"]]
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise DataError(f"The pictures {path} cannot be read: {error}.", hint="Delete the file.") from error
    if len(facts) < count:
        raise DataError(
            f"{folder} holds {len(facts)} pictures of {split}, not {count}.",
            hint="Make them: chauffeur model train vlm",
        )
    return PictureSet(np.concatenate(pixels)[:count], np.concatenate(cells)[:count], tuple(facts[:count]))


def _files(folder: Path, split: Split) -> Iterator[Path]:
    return iter(sorted(path for path in folder.glob(f"{split}-*.npz") if ".part" not in path.name))


assert math.isclose(WIDTH / HEIGHT, 448 / 256)
