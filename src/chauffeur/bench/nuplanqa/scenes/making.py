"""A data set of staged scenes and of scenes of our worlds in NuPlanQA's format: questions, metadata, pictures, pairs.

Layout of each split's folder: `questions.json` (the published format), `metadata.json` (the keys of the published
metadata: pictures, camera calibration, ego pose, `prev`), `truth.json` (classes of all families and who is where: for
training, never shown to a model), `part_0/*.jpg`, `scenes.jsonl` (what is made so far, scene by scene), and
`pairs.json` with free question-answer pairs where asked for.
Everything is simulated and rendered, and says so.
"""

from __future__ import annotations

import hashlib
import json
import multiprocessing
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
from pydantic import TypeAdapter

from chauffeur.bench.kernel.store import Row, RowStore
from chauffeur.bench.nuplanqa.frames import CAMERAS, FRAMES
from chauffeur.bench.nuplanqa.questions import SUBTASKS, VqaItem
from chauffeur.bench.nuplanqa.scenes.facts import Fact, Seen, facts_of, sighted
from chauffeur.bench.nuplanqa.scenes.gate import GateLine, gate
from chauffeur.bench.nuplanqa.scenes.records import (
    glimpsed_in,
    instant_token,
    made_out,
    metadata_of,
    save_pictures,
    truth_of,
    write_json,
)
from chauffeur.bench.nuplanqa.scenes.scene import SAMPLES, QaScene
from chauffeur.bench.nuplanqa.scenes.staging import stage
from chauffeur.bench.nuplanqa.scenes.wording import QuestionWriter, Split, free_pairs
from chauffeur.bench.nuplanqa.scenes.worlds import CLIPS, world_scene
from chauffeur.bench.openloop.driving import UNSEEN_TOWN, Place
from chauffeur.bench.sets import claim
from chauffeur.camera import LOOKS, CameraLook, Conditions, Rig, make_renderer, nuplan_rig
from chauffeur.concept import ConfigError
from chauffeur.driving.files import publish

if TYPE_CHECKING:
    from chauffeur.camera import Renderer

MADE: Final = "qa-v3"
SIMULATED: Final = (
    "Simulated: scenes are staged on random streets, or taken from our highway, crossing, towns and parking lots as "
    "their own drivers drive them; pictures are rendered and answers read off the ground truth. In NuPlanQA's format; "
    "nothing of nuPlan or NuPlanQA is in it."
)
CONDITIONS: Final[Mapping[str, Conditions]] = {
    "clear day": Conditions(),
    "rainy day": Conditions(rain=0.7),
    "foggy day": Conditions(fog=0.45),
    "snowy day": Conditions(snow=0.4),
    "clear night": Conditions(night=0.55),
    "rainy night": Conditions(rain=0.6, night=0.5),
}
Staged = Literal["staged"]
_STAGED: Final[Staged] = "staged"
_CYCLE: Final[tuple[Place | Staged, ...]] = (
    *(_STAGED, "highway", _STAGED, "town", _STAGED, "highway"),
    *(_STAGED, "town", _STAGED, "highway", "crossing", "lot"),
)
"""Sources of scenes, one after the other."""
assert _CYCLE.count("town") == CLIPS
SOURCES: Final[Mapping[str, tuple[Place | Staged, ...]]] = {
    "all": _CYCLE,
    "staged": (_STAGED,),
    "worlds": tuple(one for one in _CYCLE if one != _STAGED),
    "highway": ("highway",),
    "crossing": ("crossing",),
    "town": ("town",),
    "lot": ("lot",),
}
_SEED_OF: Final[Mapping[Split, int]] = {"train": 0, "val": 1, "test": 2}


@dataclass(frozen=True, slots=True)
class QaConfig:
    """Configuration of a set.

    Attributes:
        scenes: Of the training split; the others have a fifth each.
        seed: Of everything.
        width, height: Of the pictures, px.
        frames: Instants of a clip that are rendered.
        pairs: Free question-answer pairs for each fact of a training scene.
        pictures: Whether anything is rendered; without, visibility is computed from geometry.
        look: Palette, exposure and lens of the test split's pictures.
        sources: Where scenes come from: see SOURCES.
        front: How many times as wide and high the front camera's pictures are.
    """

    scenes: int = 1000
    seed: int = 0
    width: int = 448
    height: int = 256
    frames: int = FRAMES
    pairs: int = 0
    pictures: bool = True
    look: str = "default"
    sources: str = "all"
    front: int = 1

    @property
    def rig(self) -> Rig:
        """The cameras, with the size of their pictures."""
        rig = nuplan_rig(self.width, self.height).only(*CAMERAS)
        first, *others = rig.cameras
        return replace(rig, cameras=(first.sized(self.front * self.width, self.front * self.height), *others))

    def count(self, split: Split) -> int:
        """Scenes of a split."""
        return self.scenes if split == "train" else max(1, self.scenes // 5)

    @property
    def instants(self) -> tuple[int, ...]:
        """Rendered instants of a clip: the last ones; of two the first and the last, which show most."""
        return (0, SAMPLES - 1) if self.frames == 2 else tuple(range(SAMPLES - self.frames, SAMPLES))


_items: Final = TypeAdapter(tuple[VqaItem, ...])
Watch = Callable[[int, int], None]


def make_split(folder: Path, split: Split, config: QaConfig, watch: Watch) -> tuple[VqaItem, ...]:
    """Make a split, or what is missing of it: scenes that are made, or whose pictures are there, are not made again.

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
    claim(folder, {"made": MADE, **asdict(config)})
    rig = config.rig
    look = LOOKS[config.look] if split == "test" else LOOKS["default"]
    renderer = make_renderer() if config.pictures else None
    writer = QuestionWriter(split)
    items: list[VqaItem] = []
    metadata: dict[str, Any] = {}
    truth: dict[str, Any] = {}
    pairs: list[dict[str, Any]] = []
    count = config.count(split)
    store = RowStore(own / "scenes.jsonl", "scene")
    try:
        for number in range(count):
            token = _token(config.seed, split, number)
            row: Row | None = store.rows.get(token)
            if row is None:
                scene, rng = _stage(config, split, number)
                seen = glimpsed = sighted(scene)
                if renderer is not None:
                    seen, glimpsed = _shoot(own, scene, rig, look, renderer, config.instants)
                facts = list(facts_of(scene, seen))
                previous = instant_token(scene.token, config.instants[-2]) if config.frames > 1 else ""
                row = {
                    "scene": token,
                    "metadata": metadata_of(scene, rig, config.instants),
                    "truth": truth_of(scene, seen, glimpsed, rig),
                    "items": _items.dump_python(tuple(writer.write(scene, facts, previous, rng)), mode="json"),
                    "pairs": list(_pairs(scene, facts, config.pairs if split == "train" else 0, rng)),
                    "asked": writer.asked,
                }
                store.append(row)
            else:
                writer.go_on(row["asked"])
            metadata |= row["metadata"]
            truth[token] = row["truth"]
            items += _items.validate_python(row["items"])
            pairs += row["pairs"]
            watch(number + 1, count)
    finally:
        store.close()
        if renderer is not None:
            renderer.close()
    write_json(own / "questions.json", [item.json() for item in items])
    write_json(own / "metadata.json", metadata)
    write_json(own / "truth.json", truth)
    if pairs:
        write_json(own / "pairs.json", pairs)
    return tuple(items)


def shoot_part(folder: Path, split: Split, config: QaConfig, part: int, parts: int) -> int:
    """Render one of so many parts of a split's scenes: one process's share. Gives how many."""
    rig, renderer = config.rig, make_renderer()
    look = LOOKS[config.look] if split == "test" else LOOKS["default"]
    count = config.count(split)
    numbers = range(count * part // parts, count * (part + 1) // parts)  # neighbours may be of one trip
    try:
        for number in numbers:
            if _seen(folder / split, _token(config.seed, split, number)).is_file():
                continue
            scene, _ = _stage(config, split, number)
            _shoot(folder / split, scene, rig, look, renderer, config.instants)
    finally:
        renderer.close()
    return len(numbers)


@dataclass(frozen=True, slots=True)
class MadeSet:
    """Result of making a set: questions by split, and the gate over the test split."""

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
    if config.sources not in SOURCES:
        raise ConfigError(f"There are no scenes {config.sources!r}.", hint=f"Choose of: {', '.join(SOURCES)}.")
    splits: tuple[Split, ...] = ("train", "val", "test")
    total = sum(map(config.count, splits))
    claim(folder, {"made": MADE, **asdict(config)})
    shot = config.pictures and workers > 1
    if shot:
        make_renderer().close()  # what is missing is said here, once
        _shoot_all(folder, config, splits, workers, lambda done: watch(done, total))
    done = 0
    made: dict[Split, tuple[VqaItem, ...]] = {}
    for split in splits:
        made[split] = make_split(
            folder, split, config, lambda some, _, before=done: None if shot else watch(before + some, total)
        )
        done += config.count(split)
    tried = gate(made["test"], made["train"])
    write_card(folder, config, made, tried)
    return MadeSet({split: len(items) for split, items in made.items()}, tried)


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
        f"- Wordings of the test split are heard in no other split; the town {UNSEEN_TOWN} is in no other split.",
        "",
        "| subtask | " + " | ".join(splits) + " |",
    ]
    lines.append("|---" * (1 + len(splits)) + "|")
    counts = {split: Counter(item.subtask for item in items) for split, items in splits.items()}
    lines += [f"| {task} | " + " | ".join(str(counts[split][task]) for split in splits) + " |" for task in SUBTASKS]
    lines += ["", "| what the test split is answered from | right | worst subtask |", "|---|---:|---|"]
    lines += [f"| {one.trick} | {one.accuracy:.1%} | {one.worst_told} |" for one in tried]
    publish(folder / "CARD.md", ("\n".join(lines) + "\n").encode(), "data card")


def _stage(config: QaConfig, split: Split, number: int) -> tuple[QaScene, np.random.Generator]:
    """A scene of a split, and the generator that goes on to draw its words."""
    rng = np.random.default_rng([config.seed, _SEED_OF[split], number])
    token, cycle = _token(config.seed, split, number), SOURCES[config.sources]
    turns, place = divmod(number, len(cycle))
    source = cycle[place]
    if source == "staged":
        return stage(token, rng), rng
    nth = turns * cycle.count(source) + cycle[:place].count(source)
    # A number of its own for each seed and split, so that no trip is in two.
    first = (config.seed * len(_SEED_OF) + _SEED_OF[split]) * 1_000_000
    return world_scene(token, source, first + nth, split == "test", rng), rng


def _shoot(
    own: Path, scene: QaScene, rig: Rig, look: CameraLook, renderer: Renderer, instants: Sequence[int]
) -> tuple[Seen, Seen]:
    """Render what is not there yet. Who can be made out at the present instant, and who is glimpsed at least, is stored
    beside the pictures."""
    record = _seen(own, scene.token)
    if record.is_file():
        held: dict[str, list[int | str]] = json.loads(record.read_text(encoding="utf-8"))
        return frozenset(held["seen"]), frozenset(held["glimpsed"])
    conditions = CONDITIONS[scene.sky]
    place = int(scene.token[:8], 16)
    seen: Collection[int | str] = ()
    glimpsed: Collection[int | str] = ()
    for number in instants:
        last = number == SAMPLES - 1
        taken = renderer.render(scene.instants[number], rig, conditions, place, look=look, truth=last)
        save_pictures(own, instant_token(scene.token, number), taken)
        if last:
            seen = made_out(taken)
            glimpsed = seen | glimpsed_in(taken)
    record.parent.mkdir(exist_ok=True)
    told = {"seen": sorted(seen, key=str), "glimpsed": sorted(glimpsed, key=str)}
    publish(record, json.dumps(told).encode(), "record of who is seen")
    return seen, glimpsed


def _seen(own: Path, token: str) -> Path:
    return own / "seen" / f"{token}.json"


def _pairs(scene: QaScene, facts: list[Fact], each: int, rng: np.random.Generator) -> Iterator[dict[str, Any]]:
    for subtask, question, answer in free_pairs(scene, facts, each, rng):
        asked = (
            f"- Velocity(m/s): {list(scene.speeds_mps)}\n- Steering angles: {list(scene.steering_deg)}\n\n{question}"
        )
        yield {"sample_token": scene.token, "QA": [{"q": asked, "a": answer}], "task": subtask, "split": "train"}


def _token(seed: int, split: Split, number: int) -> str:
    return hashlib.sha256(f"{MADE} {seed} {split} {number}".encode()).hexdigest()[:16]
