"""Frames of our own camera and traffic, in nuScenes' format: front picture and 2 s of motion to 3 s of waypoints.

Most of driving is straight on, and there a car's own motion tells its future: open-loop figures on plain logs are won
by models that see nothing. So a frame is kept only where the motion of the last second is steady (constant speed,
straight, or standing), and then in fixed shares of what happens in the next three seconds: a car ahead or a red light
makes it brake, a junction makes it turn, a green light lets it start, or nothing happens. The shares are part of the
set and stand on its card, and baselines that see nothing are printed beside every figure.

Splits share no trip and no seed, and the test split's town is in no other. Beside the tables stands `perception.json`:
what the simulator knows of each marked picture, for training encoders. Simulated and rendered, and says so.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from chauffeur.bench.openloop.driving import AXLE_M, TOWNS, UNSEEN_TOWN, FrameMoment, Place, TrafficTrip, instants
from chauffeur.bench.openloop.extrapolation import FutureKind, kind_of, tells_nothing
from chauffeur.bench.openloop.nuscenes import in_frame
from chauffeur.bench.openloop.writer import DrivenSample, DrivenScene, picture_file, sample_token, write_tables
from chauffeur.bench.sets import claim
from chauffeur.camera import Camera, Conditions, Rig
from chauffeur.concept import ConfigError, ScenarioError
from chauffeur.driving.files import publish
from chauffeur.foreign.waypoints import FUTURE
from chauffeur.geometry import Pose
from chauffeur.planners.prompts.waypoints import HISTORY

if TYPE_CHECKING:
    from chauffeur.camera import Renderer

Split = Literal["train", "val", "test"]
SPLITS: Final[tuple[Split, ...]] = ("train", "val", "test")
MADE: Final = "frames-v3"
SIMULATED: Final = (
    "Simulated: driven by the worlds' own drivers in our towns, on our highway and crossing, and rendered. In "
    "nuScenes' file format; nothing of nuScenes is in it."
)
SHARES: Final[Mapping[FutureKind, float]] = {
    "stays": 0.14,
    "starts": 0.22,
    "turns": 0.18,
    "brakes": 0.26,
    "speeds up": 0.08,
    "goes on": 0.12,
}
"""Greatest share of each kind in a split."""
PERCEPTION: Final = "perception.json"
VIEW_RAD: Final = 1.05
_SKIES: Final = (
    (0.70, Conditions()),
    (0.80, Conditions(rain=0.4)),
    (0.90, Conditions(fog=0.25)),
    (1.01, Conditions(night=0.45)),
)


@dataclass(frozen=True, slots=True)
class FramesConfig:
    """Configuration of a set.

    Attributes:
        trips: Of the training split; the others have an eighth and a quarter.
        seed: Of everything.
        width, height: Of the pictures, px.
        seconds: Of a trip in town, at most.
        most: Frames that are kept of a trip, at most.
        towns: Of training and validation, in turn; other towns than ours are found by the name of their pack.
    """

    trips: int = 160
    seed: int = 0
    width: int = 160
    height: int = 96
    seconds: float = 80.0
    most: int = 60
    towns: tuple[str, ...] = TOWNS

    def __post_init__(self) -> None:
        """Raises ConfigError: no town, or the test split's own."""
        if not self.towns or UNSEEN_TOWN in self.towns:
            raise ConfigError(
                f"Frames need towns to drive in, and {UNSEEN_TOWN} is the test split's.",
                hint=f"By default they are {', '.join(TOWNS)}.",
            )

    def count(self, split: Split) -> int:
        """Trips of a split."""
        return {"train": self.trips, "val": max(2, self.trips // 8), "test": max(4, self.trips // 4)}[split]

    @property
    def camera(self) -> Camera:
        """The front camera, 60 degrees wide; its vehicle frame begins at the rear axle."""
        return Camera.of_view("CAM_FRONT", (self.width, self.height), VIEW_RAD, (2.0, 0.0, 1.45), 0.0, 0.035)


def trip_of(config: FramesConfig, split: Split, number: int) -> TrafficTrip:
    """A trip of a split: of eight, six in town, one on the highway, one over a crossing."""
    seed = int(np.random.SeedSequence([config.seed, SPLITS.index(split), number]).generate_state(1)[0])
    turn = number % 8
    place: Place = "highway" if turn == 3 else "crossing" if turn == 7 else "town"
    in_town = number // 4 * 3 + number % 4  # how many trips before this one are in town
    town = UNSEEN_TOWN if split == "test" else config.towns[in_town % len(config.towns)]
    seconds = {"town": config.seconds, "highway": min(60.0, config.seconds), "crossing": min(30.0, config.seconds)}
    return TrafficTrip(f"{split}-{number:04}-{place}", place, town if place == "town" else "", seed, seconds[place])


def rear_axle(seen: FrameMoment, place: Place) -> Pose:
    """Pose of the rear axle's middle."""
    ego = seen.observation.ego
    return Pose(ego.x_m, ego.y_m, ego.heading_rad).ahead(-_axle_m(place))


def _axle_m(place: Place) -> float:
    if place != "town":
        return AXLE_M
    from chauffeur.control.kinematic_bicycle import LINCOLN_MKZ

    return LINCOLN_MKZ.rear_to_middle_m


def chosen(kinds: Sequence[FutureKind | None], most: int, rng: np.random.Generator) -> list[int]:
    """Places of the moments of a trip that are kept: of each kind at most its share of `most`; None are never kept."""
    kept: list[int] = []
    for kind, share in SHARES.items():
        own = [i for i, one in enumerate(kinds) if one == kind]
        many = min(len(own), max(1, round(share * most)))
        kept += [own[int(i)] for i in rng.permutation(len(own))[:many]]
    return sorted(kept)


@dataclass(frozen=True, slots=True)
class _Made:
    """A trip as it is stored: poses, marks (moment, command, kind) and what is known of each marked picture."""

    poses: list[tuple[float, float, float]]
    marks: dict[int, tuple[str, str]]
    known: dict[int, list[float]]


def _drive(root: Path, config: FramesConfig, trip: TrafficTrip, renderer: Renderer) -> _Made:
    """Drive a trip, choose its frames and render them; what is there already is read."""
    record = root / "trips" / f"{trip.name}.json"
    if record.is_file():
        held = json.loads(record.read_text(encoding="utf-8"))
        marks = {int(i): (one[0], one[1]) for i, one in held["marks"].items()}
        known = {int(i): one for i, one in held["known"].items()}
        return _Made([(x, y, h) for x, y, h in held["poses"]], marks, known)
    moments = list(instants(trip))
    poses = np.array([[p.x_m, p.y_m, p.heading_rad] for p in (rear_axle(one, trip.place) for one in moments)])
    kinds: list[FutureKind | None] = [None] * len(moments)
    for at in range(HISTORY, len(moments) - FUTURE):
        history = in_frame(poses[at - HISTORY : at + 1], poses[at])
        if tells_nothing(history):
            kinds[at] = kind_of(history, in_frame(poses[at + 1 : at + 1 + FUTURE], poses[at])[:, :2])
    rng = np.random.default_rng([trip.seed, 13])
    # The highway's traffic hardly ever stops or turns: fewer of its frames, so that the shares hold.
    most = config.most if trip.place == "town" else config.most // 3
    kept = chosen(kinds, most, rng)
    conditions = next(one for bound, one in _SKIES if bound > rng.random())
    _render(root, config, trip, [(i, moments[i]) for i in kept], renderer, conditions)
    made = _Made(
        [(round(float(x), 4), round(float(y), 4), round(float(h), 6)) for x, y, h in poses],
        {i: (moments[i].command, str(kinds[i])) for i in kept},
        {
            # lead's gap (m) and speed (m/s), way to the next halt and junction (m)
            i: [round(value, 2) for value in (one.lead_m, one.lead_mps, one.halt_m, one.junction_m)]
            for i, one in ((i, moments[i]) for i in kept)
        },
    )
    publish(record, json.dumps(asdict(made)).encode(), "record of a trip")
    return made


def _render(
    root: Path,
    config: FramesConfig,
    trip: TrafficTrip,
    moments: Sequence[tuple[int, FrameMoment]],
    renderer: Renderer,
    conditions: Conditions,
) -> None:
    from PIL import Image

    rig = Rig("frames", (config.camera,), -_axle_m(trip.place))
    for i, one in moments:
        taken = renderer.render(one.observation, rig, conditions, trip.seed)
        path = root / picture_file(trip.name, i)
        path.parent.mkdir(parents=True, exist_ok=True)
        Image.fromarray(taken.images[0].pixels()).save(path, "JPEG", quality=92)


def make_frames(
    root: Path, config: FramesConfig, watch: Callable[[int, int], None], splits: Sequence[Split] = SPLITS
) -> Mapping[Split, Mapping[str, int]]:
    """Make a set, or what is missing of it: trips that are done are not driven again.

    Args:
        root: Folder of the set.
        config: What decides it.
        watch: Is told (trips done, trips).
        splits: Which.

    Returns:
        Frames by split and kind.

    Raises:
        ConfigError: The folder holds a set of another configuration.
        DataError: A file cannot be written.
        MissingExtraError: Town simulator or renderer is not installed.
    """
    from chauffeur.camera import make_renderer

    claim(root, {"made": MADE, **asdict(config)}, indent=1)
    total = sum(config.count(split) for split in splits)
    done = 0
    counts: dict[Split, Mapping[str, int]] = {}
    renderer = make_renderer()
    (root / "trips").mkdir(exist_ok=True)
    try:
        for split in splits:
            scenes: list[DrivenScene] = []
            known: dict[str, list[float]] = {}
            kinds: Counter[str] = Counter()
            for number in range(config.count(split)):
                trip = trip_of(config, split, number)
                try:
                    made = _drive(root, config, trip, renderer)
                except ScenarioError:  # a start that cannot be: the next trip has another
                    made = _Made([], {}, {})
                done += 1
                watch(done, total)
                if not made.marks:
                    continue
                kinds.update(kind for _, kind in made.marks.values())
                known |= {sample_token(trip.name, i): values for i, values in made.known.items()}
                samples = tuple(
                    DrivenSample(*pose, None if i not in made.marks else (*made.marks[i], trip.place))
                    for i, pose in enumerate(made.poses)
                )
                scenes.append(DrivenScene(trip.name, f"simulated: {trip.place} {trip.town}".strip(), samples))
            folder = write_tables(root, f"v1.0-{split}", scenes, config.camera)
            publish(folder / PERCEPTION, json.dumps(known).encode(), "what is known of the pictures")
            counts[split] = kinds
    finally:
        renderer.close()
    _card(root, config, counts)
    return counts


def _card(root: Path, config: FramesConfig, counts: Mapping[Split, Mapping[str, int]]) -> None:
    lines = ["# Data card: frames of our own camera and traffic", "", f"- {SIMULATED}", f"- Made by {MADE}."]
    values: dict[str, Any] = {name: value for name, value in asdict(config).items() if name != "towns"}
    lines += [f"- {name}: {value}" for name, value in values.items()]
    lines += [
        f"- Towns of training and validation: {', '.join(config.towns)}; of the test split: {UNSEEN_TOWN}.",
        "- Not the natural mix of driving: frames are of steady motion, chosen by what happens next, so that a car's",
        "  own motion does not tell it.",
        "",
        "| what happens | " + " | ".join(counts) + " |",
        "|---" + "|---:" * len(counts) + "|",
    ]
    lines += [
        f"| {kind} | " + " | ".join(str(counts[split].get(kind, 0)) for split in counts) + " |" for kind in SHARES
    ]
    publish(root / "CARD.md", ("\n".join(lines) + "\n").encode(), "data card")
