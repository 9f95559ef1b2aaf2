"""A data set of staged scenes in NuPlanQA's format: questions, metadata, pictures, free pairs and a card.

Layout of each split's folder: `questions.json` (the published format), `metadata.json` (the keys of the published
metadata: pictures, camera calibration, ego pose, `prev`), `truth.json` (classes of all families and who is where: for
training, never shown to a model), `part_0/*.jpg`, and `pairs.json` with free question-answer pairs where asked for.
Everything is rendered and staged, and says so.
"""

from __future__ import annotations

import hashlib
import json
import math
import multiprocessing
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from chauffeur.bench.nuplanqa.frames import CAMERAS, FRAMES
from chauffeur.bench.nuplanqa.questions import SUBTASKS, VqaItem
from chauffeur.bench.nuplanqa.scenes.facts import Fact, VehicleObservation, facts_of, sighted
from chauffeur.bench.nuplanqa.scenes.gate import GateLine, gate
from chauffeur.bench.nuplanqa.scenes.staging import SAMPLES, STEP_S, StagedScene, stage
from chauffeur.bench.nuplanqa.scenes.wording import QuestionWriter, Split, free_pairs
from chauffeur.camera import LOOKS, Camera, CameraImages, CameraLook, Conditions, Rig, make_renderer, nuplan_rig
from chauffeur.concept import ConfigError
from chauffeur.concept.scene import Observation
from chauffeur.drive.files import publish

if TYPE_CHECKING:
    from chauffeur.camera import Renderer

MADE: Final = "staged-qa-v2"
SIMULATED: Final = (
    "Simulated: streets are drawn at random, road users staged, pictures rendered and answers read off the ground "
    "truth. In NuPlanQA's format; nothing of nuPlan or NuPlanQA is in it."
)
CONDITIONS: Final[Mapping[str, Conditions]] = {
    "clear day": Conditions(),
    "rainy day": Conditions(rain=0.7),
    "foggy day": Conditions(fog=0.45),
    "snowy day": Conditions(snow=0.4),
    "clear night": Conditions(night=0.55),
    "rainy night": Conditions(rain=0.6, night=0.5),
}
LEAST_SHARE: Final = 0.35
"""Share of a road user that must be unhidden in the picture that shows it best."""
_SEED_OF: Final[Mapping[Split, int]] = {"train": 0, "val": 1, "test": 2}


@dataclass(frozen=True, slots=True)
class QaConfig:
    """What decides a set.

    Attributes:
        scenes: Of the training split; the others have a fifth each.
        seed: Of everything.
        width, height: Of the pictures, px.
        frames: Instants of a clip that are rendered.
        pairs: Free question-answer pairs for each fact of a training scene.
        pictures: Whether anything is rendered; without, visibility is computed from geometry.
        look: Palette, exposure and lens of the test split's pictures.
    """

    scenes: int = 1000
    seed: int = 0
    width: int = 448
    height: int = 256
    frames: int = FRAMES
    pairs: int = 0
    pictures: bool = True
    look: str = "default"

    def count(self, split: Split) -> int:
        """Scenes of a split."""
        return self.scenes if split == "train" else max(1, self.scenes // 5)

    @property
    def instants(self) -> tuple[int, ...]:
        """Which instants of a clip are rendered: the last ones; of two the first and the last, which show most."""
        return (0, SAMPLES - 1) if self.frames == 2 else tuple(range(SAMPLES - self.frames, SAMPLES))


Watch = Callable[[int, int], None]


def make_split(folder: Path, split: Split, config: QaConfig, watch: Watch) -> tuple[VqaItem, ...]:
    """Make a split, or what is missing of it: scenes whose pictures are there are not rendered again.

    Args:
        folder: Folder of the set; the split gets one below it.
        split: Which.
        config: What decides the set.
        watch: Is told (scenes done, scenes).

    Raises:
        ConfigError: The folder holds a set of another configuration.
        DataError: A file cannot be written.
        MissingExtraError: Nothing can be rendered here.
    """
    if not 1 <= config.frames <= SAMPLES:
        raise ConfigError(f"A clip has no {config.frames} instants.", hint=f"Give 1 to {SAMPLES}.")
    own = folder / split
    _claim(folder, config)
    rig = nuplan_rig(config.width, config.height).only(*CAMERAS)
    look = LOOKS[config.look] if split == "test" else LOOKS["default"]
    renderer = make_renderer() if config.pictures else None
    writer = QuestionWriter(split)
    items: list[VqaItem] = []
    metadata: dict[str, Any] = {}
    truth: dict[str, Any] = {}
    pairs: list[dict[str, Any]] = []
    count = config.count(split)
    try:
        for number in range(count):
            scene, rng = _stage(config, split, number)
            seen = sighted(scene) if renderer is None else _shoot(own, scene, rig, look, renderer, config.instants)
            metadata |= _metadata(scene, rig, config)
            facts = list(facts_of(scene, seen))
            truth[scene.token] = _truth(scene, facts, seen, rig)
            previous = _instant_token(scene.token, config.instants[-2]) if config.frames > 1 else ""
            items += writer.write(scene, facts, previous, rng)
            pairs += _pairs(scene, facts, config.pairs if split == "train" else 0, rng)
            watch(number + 1, count)
    finally:
        if renderer is not None:
            renderer.close()
    write_json(own / "questions.json", [item.json() for item in items])
    write_json(own / "metadata.json", metadata)
    write_json(own / "truth.json", truth)
    if pairs:
        write_json(own / "pairs.json", pairs)
    return tuple(items)


def shoot_part(folder: Path, split: Split, config: QaConfig, part: int, parts: int) -> int:
    """Render every `parts`-th scene of a split from `part` on: one process's share. Gives how many."""
    rig, renderer = nuplan_rig(config.width, config.height).only(*CAMERAS), make_renderer()
    look = LOOKS[config.look] if split == "test" else LOOKS["default"]
    numbers = range(part, config.count(split), parts)
    try:
        for number in numbers:
            scene, _ = _stage(config, split, number)
            _shoot(folder / split, scene, rig, look, renderer, config.instants)
    finally:
        renderer.close()
    return len(numbers)


@dataclass(frozen=True, slots=True)
class MadeSet:
    """What came of making a set: questions by split, and the gate over the test split."""

    questions: Mapping[str, int]
    gate: tuple[GateLine, ...]


def make_set(folder: Path, config: QaConfig, workers: int, watch: Watch) -> MadeSet:
    """Make all splits, their card, and try the tricks on the test split.

    Args:
        folder: Where to.
        config: What decides the set; however many processes make it, it is the same.
        workers: Processes that render.
        watch: Is told (scenes done, scenes).

    Raises:
        ConfigError: The folder holds a set of another configuration, or the options make no sense.
        DataError: A file cannot be written.
        MissingExtraError: Nothing can be rendered here.
    """
    if config.look not in LOOKS:
        raise ConfigError(f"There is no look {config.look!r}.", hint=f"Choose of: {', '.join(LOOKS)}.")
    splits: tuple[Split, ...] = ("train", "val", "test")
    total = sum(map(config.count, splits))
    _claim(folder, config)
    shot = config.pictures and workers > 1
    if shot:
        make_renderer().close()  # what is missing is said here, once
        _shoot_all(folder, config, splits, workers, lambda done: watch(done, total))
    done = 0
    made: dict[Split, tuple[VqaItem, ...]] = {}
    for split in splits:
        before = done
        told: Watch = _unwatched if shot else lambda some, _, before=before: watch(before + some, total)
        made[split] = make_split(folder, split, config, told)
        done += config.count(split)
    tried = gate(made["test"], made["train"])
    write_card(folder, config, made, tried)
    return MadeSet({split: len(items) for split, items in made.items()}, tried)


def _unwatched(done: int, of: int) -> None:
    """Tells nobody: the scenes were counted when they were rendered."""
    del done, of


def _shoot_all(
    folder: Path, config: QaConfig, splits: Sequence[Split], workers: int, told: Callable[[int], None]
) -> None:
    """Render with several processes; each takes every so many scenes of a split."""
    done = 0
    with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        parts = workers * 8
        waiting = [
            pool.submit(shoot_part, folder, split, config, part, parts) for split in splits for part in range(parts)
        ]
        try:
            for future in as_completed(waiting):
                if (more := future.result()) > 0:
                    done += more
                    told(done)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def write_card(
    folder: Path, config: QaConfig, splits: Mapping[Split, tuple[VqaItem, ...]], tried: Sequence[GateLine]
) -> None:
    """The card of a set: what it is, how many questions, and how far the tricks lead."""
    lines = ["# Data card: simulated questions in NuPlanQA's format", "", f"- {SIMULATED}", f"- Made by {MADE}."]
    lines += [f"- {name}: {value}" for name, value in asdict(config).items()]
    lines += [
        "- Wordings of the test split are heard in no other split.",
        "",
        "| subtask | " + " | ".join(splits) + " |",
    ]
    lines.append("|---" * (1 + len(splits)) + "|")
    counts = {split: Counter(item.subtask for item in items) for split, items in splits.items()}
    lines += [f"| {task} | " + " | ".join(str(counts[split][task]) for split in splits) + " |" for task in SUBTASKS]
    lines += ["", "| what the test split is answered from | right | worst subtask |", "|---|---:|---|"]
    lines += [f"| {one.trick} | {one.accuracy:.1%} | {one.worst_told} |" for one in tried]
    publish(folder / "CARD.md", ("\n".join(lines) + "\n").encode(), "data card")


def _stage(config: QaConfig, split: Split, number: int) -> tuple[StagedScene, np.random.Generator]:
    """A scene of a split, and the generator that goes on to draw its words."""
    rng = np.random.default_rng([config.seed, _SEED_OF[split], number])
    return stage(_token(config.seed, split, number), rng), rng


def _shoot(
    own: Path, scene: StagedScene, rig: Rig, look: CameraLook, renderer: Renderer, instants: Sequence[int]
) -> VehicleObservation:
    """Render what is not there yet; who can be made out at the present instant is stored beside the pictures."""
    record = own / "seen" / f"{scene.token}.json"
    if record.is_file():
        return frozenset(json.loads(record.read_text(encoding="utf-8")))
    conditions = CONDITIONS[scene.sky]
    place = int(scene.token[:8], 16)
    seen: Collection[int | str] = ()
    for number in instants:
        last = number == SAMPLES - 1
        taken = renderer.render(scene.instants[number], rig, conditions, place, look=look, truth=last)
        save_pictures(own, _instant_token(scene.token, number), taken)
        if last:
            seen = made_out(taken)
    record.parent.mkdir(exist_ok=True)
    publish(record, json.dumps(sorted(seen, key=str)).encode(), "record of who is seen")
    return seen


def save_pictures(folder: Path, token: str, taken: CameraImages) -> None:
    """Write the pictures of an instant where `calibrated` says."""
    from PIL import Image

    (folder / "part_0").mkdir(parents=True, exist_ok=True)
    for camera, image in zip(taken.cameras, taken.images, strict=True):
        # Colours at full resolution: a lamp is two or three pixels.
        Image.fromarray(image.pixels()).save(folder / _picture(token, camera.name), "JPEG", quality=92, subsampling=0)


def calibrated(token: str, cameras: Sequence[Camera], instant: Observation) -> dict[str, Any]:
    """Where the pictures of an instant are, their calibration, and the ego's pose: keys of the published metadata."""
    cams = {
        camera.name: {
            "data_path": _picture(token, camera.name),
            "sensor2ego_translation": list(camera.position_m),
            "sensor2ego_rotation": list(camera.quaternion),
            "cam_intrinsic": camera.intrinsics.tolist(),
        }
        for camera in cameras
    }
    return {"cams": cams, "ego_pose": _pose(instant)}


def made_out(taken: CameraImages) -> frozenset[int | str]:
    """Ids of the road users and lights that at least one picture shows large and free enough to be told apart."""
    found: set[int | str] = set()
    for truth in taken.truth:
        height, width = truth.instances.shape
        least = max(4.0, 12.0 * width * height / (112.0 * 64.0))
        for one in truth.sightings:
            lamp = one.instance.source == "signal"
            if one.pixels >= (least / 3.0 if lamp else least) and one.visibility >= LEAST_SHARE:
                found.add(one.instance.id)
    return frozenset(found)


def _metadata(scene: StagedScene, rig: Rig, config: QaConfig) -> dict[str, Any]:
    """Metadata of the instants of a scene, with the keys of the published file."""
    found: dict[str, Any] = {}
    instants = config.instants
    for place, number in enumerate(instants):
        token = _instant_token(scene.token, number)
        found[token] = {
            **calibrated(token, rig.cameras, scene.instants[number]),
            "frame_idx": number,
            "timestamp": round(number * STEP_S * 1e6),
            "scene_token": scene.token,
            "scenario": scene.scene_type,
            "traffic_light": [] if scene.light is None else [scene.light],
            "prev": _instant_token(scene.token, instants[place - 1]) if place else "",
            "next": _instant_token(scene.token, instants[place + 1]) if number + 1 < SAMPLES else "",
        }
    return found


def _truth(scene: StagedScene, facts: Sequence[Fact], seen: VehicleObservation, rig: Rig) -> dict[str, Any]:
    """What a network may be taught besides the questions: classes of all families, and who is where.

    Road users are (kind, x, y, whether they can be made out), in the frame of the rig: x forward, y left, m. Of the
    lead vehicle: how far ahead, centre to centre, m, and how much faster than the ego it is, m/s; nothing where it
    cannot be made out, and an empty list for none.
    """
    lead = scene.lead
    told: list[float] | None = []
    if lead is not None:
        faster = next(one.speed_mps for one in scene.now.others if one.id == lead.id) - scene.now.ego.speed_mps
        told = [round(lead.station_m, 2), round(faster, 2)] if lead.id in seen else None
    return {
        "motion": scene.motion,
        "lead": told,
        "facts": [[fact.family, fact.side, fact.value] for fact in facts],
        "users": truth_of_users(scene.now, seen, rig),
    }


def truth_of_users(
    observation: Observation, seen: VehicleObservation, rig: Rig
) -> list[tuple[str, float, float, bool]]:
    """Road users as (kind, x, y, whether they can be made out), in the frame of the rig."""
    ego = observation.ego
    c, s = math.cos(ego.heading_rad), math.sin(ego.heading_rad)
    users: list[tuple[str, float, float, bool]] = []
    for one in observation.others:
        dx, dy = one.x_m - ego.x_m, one.y_m - ego.y_m
        x, y = c * dx + s * dy - rig.origin_ahead_m, c * dy - s * dx
        users.append((one.kind, round(x, 2), round(y, 2), one.id in seen))
    return users


def _pose(instant: Observation) -> dict[str, float]:
    ego = instant.ego
    return {
        "x": ego.x_m,
        "y": ego.y_m,
        "z": 0.0,
        "qw": math.cos(ego.heading_rad / 2.0),
        "qx": 0.0,
        "qy": 0.0,
        "qz": math.sin(ego.heading_rad / 2.0),
        "vx": ego.speed_mps,
        "acceleration_x": ego.acceleration_mps2,
    }


def _pairs(scene: StagedScene, facts: list[Fact], each: int, rng: np.random.Generator) -> Iterator[dict[str, Any]]:
    for subtask, question, answer in free_pairs(scene, facts, each, rng):
        asked = (
            f"- Velocity(m/s): {list(scene.speeds_mps)}\n- Steering angles: {list(scene.steering_deg)}\n\n{question}"
        )
        yield {"sample_token": scene.token, "QA": [{"q": asked, "a": answer}], "task": subtask, "split": "train"}


def _token(seed: int, split: Split, number: int) -> str:
    return hashlib.sha256(f"{MADE} {seed} {split} {number}".encode()).hexdigest()[:16]


def _instant_token(token: str, number: int) -> str:
    """Token of an instant of a scene; the present one's is the scene's own."""
    if number == SAMPLES - 1:
        return token
    return hashlib.sha256(f"{token} {number}".encode()).hexdigest()[:16]


def _picture(token: str, camera: str) -> str:
    return f"part_0/{token}_{camera}.jpg"


def _claim(folder: Path, config: QaConfig) -> None:
    path = folder / "config.json"
    wanted = {"made": MADE, **asdict(config)}
    if path.is_file():
        if json.loads(path.read_text(encoding="utf-8")) != wanted:
            raise ConfigError(f"{folder} holds a set of another configuration.", hint="Choose another folder.")
        return
    folder.mkdir(parents=True, exist_ok=True)
    write_json(path, wanted)


def write_json(path: Path, value: Any) -> None:
    """Write a file of a set."""
    path.parent.mkdir(parents=True, exist_ok=True)
    publish(path, (json.dumps(value, ensure_ascii=False) + "\n").encode(), "data set")
