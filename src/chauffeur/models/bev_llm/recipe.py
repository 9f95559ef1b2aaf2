# pyright: reportMissingImports=false, reportUnknownParameterType=false, reportPrivateImportUsage=false
"""The compact BEV-LLM's recipe, in three stages.

First perception: encoder, fusion, gist and resampler learn the ground truth of the scenes (classes of all facets, who
is in which cell). Then gathering: the same, with the encoder frozen, whose features are computed once, so that a step
costs no picture. Then language: with all that frozen, the decoder learns what a question with an option means (facet
and class), and to answer from the tokens alone, which are computed once as well. Questions are drawn anew in every
step, from the ground truth in the wordings of the training half; every class of a family is drawn as often as every
other. The loss is the cross-entropy of the right option among the four and that of the meanings. Batches without
history, side views or cells are among the first two stages' (`Keep`), so that an ablation at the test meets a network
that has seen the like.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import torch
from torch.nn.functional import cross_entropy, nll_loss

from chauffeur.bench.nuplanqa.frames import CAMERAS, FrameSource
from chauffeur.bench.nuplanqa.metadata import load_metadata
from chauffeur.bench.nuplanqa.questions import SUBTASKS, VqaItem, load_questions
from chauffeur.bench.nuplanqa.scenes.facts import Fact
from chauffeur.bench.nuplanqa.scenes.wording import phrase
from chauffeur.camera import Camera
from chauffeur.concept import DataError
from chauffeur.models.bev_llm.facets import Facets, cells_of, facets, labels_of
from chauffeur.models.bev_llm.fusion import FusionConfig, rig_tensors
from chauffeur.models.bev_llm.geometry import rig_geometry
from chauffeur.models.bev_llm.network import CompactBevLlm, CompactConfig, Keep
from chauffeur.models.bev_llm.views import FRONT_VIEWS, VIEWS, camera_of, cut, view_cameras
from chauffeur.models.bev_llm.vocabulary import PAD, STRANGE, QuestionWordTable
from chauffeur.models.train.trainer import Optimisation, fit

if TYPE_CHECKING:
    from numpy.typing import NDArray

SIZE: Final = (64, 112)
"""Height and width of a view, px."""
WEIGHTS: Final = Path(__file__).parent / "weights"
"""The shipped network."""
_CELLS_SHARE: Final = 0.5
_EMPTY_WEIGHT: Final = 0.15
"""Of an empty cell in the loss: nine of ten are empty."""
_WARM_STEPS: Final = 60
_EVENED: Final = 0.5
"""Power of a class's rarity that weighs it in the loss of perception."""
_COOLING: Final = 0.25
_LONG_COOLING: Final = 0.6
"""Last share of a stage in which the learning rate falls."""
_MEANING_SHARE: Final = 1.0
_UNKNOWN_WORDS: Final = 0.1
"""Share of words that the network is made not to know in training, as it will not know some of the test's."""


Watch = Callable[[str, int, float, float], None]
"""Is told (stage, step, loss, seconds)."""


@dataclass(frozen=True, slots=True)
class BevLlmRecipe:
    """Settings that decide a training.

    Attributes:
        steps: Optimiser steps of perception.
        scenes: Scenes in a batch of perception.
        rate: Highest learning rate of perception.
        gather_steps: Optimiser steps of gathering.
        gather_scenes: Scenes in a batch of gathering.
        gather_rate: Highest learning rate of gathering.
        word_steps: Optimiser steps of language.
        questions: Questions in a batch of language.
        word_rate: Highest learning rate of language.
        seed: Of weights and batches.
        ablation: `full`; or what is kept from the network from the start, see Keep.
        half: Wordings that language is taught: `train`, or `spoken` to choose by the rest of them (see `wordings`).
    """

    steps: int = 3000
    scenes: int = 16
    rate: float = 2e-3
    gather_steps: int = 1500
    gather_scenes: int = 32
    gather_rate: float = 2e-3
    word_steps: int = 300
    questions: int = 32
    word_rate: float = 2e-3
    seed: int = 0
    ablation: Keep = "full"
    half: str = "train"


@dataclass(frozen=True, eq=False)
class QaTensors:
    """A split in memory.

    Attributes:
        now: Views at the present instant, (scenes, views, 3, H, W), uint8.
        past: The front camera's views at the instant before, (scenes, 0 or 1, FRONT_VIEWS, 3, H, W), uint8.
        motion: See BevFusion, (scenes, instants, 3).
        truth: Of each scene, as `truth.json` has it.
        speeds_mps: Of the ego at the first and at the last instant, (scenes, 2).
        questions: Of each scene.
        cameras: Of the views.
    """

    now: NDArray[np.uint8]
    past: NDArray[np.uint8]
    motion: NDArray[np.float32]
    truth: tuple[Mapping[str, Any], ...]
    speeds_mps: NDArray[np.float32]
    questions: tuple[tuple[VqaItem, ...], ...]
    cameras: tuple[Camera, ...]

    @property
    def items(self) -> list[VqaItem]:
        """All questions."""
        return [item for found in self.questions for item in found]


def load_split(folder: Path, limit: int = 0) -> QaTensors:
    """Read a split that `chauffeur bench scenes qa` has made. Of its instants the first and the last are taken.

    Args:
        folder: Of the split.
        limit: Only the first so many scenes; 0 for all.

    Raises:
        DataError: Something of it is missing or damaged.
    """
    metadata = load_metadata(folder / "metadata.json")
    try:
        truth: dict[str, Any] = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise DataError(
            f"{folder} holds no ground truth: {error}.", hint="Make the set again: chauffeur bench scenes qa"
        ) from error
    by_token: dict[str, list[VqaItem]] = {token: [] for token in truth}
    if (folder / "questions.json").is_file():  # clips of drives have none
        for item in load_questions(folder / "questions.json").items:
            by_token.setdefault(item.token, []).append(item)
    tokens = [token for token in by_token if token in truth][: limit or None]
    if not tokens:
        raise DataError(f"{folder} holds no scene.")
    first = tokens[0]
    instants = 2 if metadata[first].get("prev") else 1
    source = FrameSource(folder, metadata, CAMERAS, frames=99)
    now = np.zeros((len(tokens), len(VIEWS), 3, *SIZE), np.uint8)
    past = np.zeros((len(tokens), instants - 1, FRONT_VIEWS, 3, *SIZE), np.uint8)
    motion = np.zeros((len(tokens), instants, 3), np.float32)
    speeds = np.zeros((len(tokens), 2), np.float32)
    for row, token in enumerate(tokens):
        frames = source.paths(token)
        newest = {one.camera: one.path for one in frames if one.ago_s == 0.0}
        _look(now[row], newest)
        if instants > 1:
            _look(past[row, 0], {one.camera: one.path for one in frames[: len(CAMERAS)]})
        motion[row], speeds[row] = _motion(metadata, token, instants)
    cameras = view_cameras([_camera(folder, metadata[first]["cams"], name) for name in CAMERAS], SIZE)
    questions = tuple(tuple(by_token[token]) for token in tokens)
    return QaTensors(now, past, motion, tuple(truth[token] for token in tokens), speeds, questions, cameras)


def joined(splits: Sequence[QaTensors]) -> QaTensors:
    """Splits of several sets as one. Raises DataError: their cameras or their instants differ."""
    first, *others = splits
    if any(one.cameras != first.cameras or one.past.shape[1:] != first.past.shape[1:] for one in others):
        raise DataError("The sets differ in their cameras or their instants.", hint="Make them with the same options.")
    return QaTensors(
        np.concatenate([one.now for one in splits]),
        np.concatenate([one.past for one in splits]),
        np.concatenate([one.motion for one in splits]),
        tuple(truth for one in splits for truth in one.truth),
        np.concatenate([one.speeds_mps for one in splits]),
        tuple(found for one in splits for found in one.questions),
        first.cameras,
    )


def _look(out: NDArray[np.uint8], paths: Mapping[str, Path]) -> None:
    """Fill views, (views, 3, H, W), from pictures."""
    for camera, path in paths.items():
        views = [place for place, view in enumerate(VIEWS[: len(out)]) if camera_of(view) == camera]
        if not views:
            continue
        with _opened(path) as image:
            picture = image.convert("RGB")
        for place in views:
            out[place] = cut(picture, VIEWS[place], SIZE)


def _opened(path: Path) -> Any:
    from PIL import Image

    try:
        return Image.open(path)
    except OSError as error:
        raise DataError(f"Cannot read the picture {path}: {error}.") from error


def _camera(folder: Path, cams: Mapping[str, Any], name: str) -> Camera:
    one = cams[name]
    with _opened(folder / one["data_path"]) as image:
        size = image.size
    return Camera.of_calibration(
        name, size, one["sensor2ego_translation"], one["sensor2ego_rotation"], one["cam_intrinsic"]
    )


def _motion(metadata: Mapping[str, Any], token: str, instants: int) -> tuple[NDArray[np.float32], tuple[float, float]]:
    """Motion of the ego from the first instant to the last: forward and left in tens of m, turned in rad; and its
    speeds at both, m/s."""
    now = before = metadata[token]["ego_pose"]
    at = str(metadata[token].get("prev") or "")
    while at:
        before, at = metadata[at]["ego_pose"], str(metadata[at].get("prev") or "")
    heading = 2.0 * math.atan2(before["qz"], before["qw"])
    dx, dy = now["x"] - before["x"], now["y"] - before["y"]
    turned = math.remainder(2.0 * math.atan2(now["qz"], now["qw"]) - heading, math.tau)
    c, s = math.cos(heading), math.sin(heading)
    found = np.zeros((instants, 3), np.float32)
    if instants > 1:
        found[-1] = ((c * dx + s * dy) / 10.0, (c * dy - s * dx) / 10.0, turned)
    return found, (float(before["vx"]), float(now["vx"]))


def compact(recipe: BevLlmRecipe, words: QuestionWordTable, of: Facets, size: tuple[int, int] = SIZE) -> CompactConfig:
    """The network that a recipe asks for."""
    fusion = FusionConfig(64, 2, bev_width=64, bev=recipe.ablation != "no-bev", history=recipe.ablation != "no-history")
    return CompactConfig(words.size, tuple(len(classes) for _, classes in of), size=size, fusion=fusion)


class CompactAnswerer:
    """A network with its words, its facets and its rig.

    Attributes:
        network: The network.
        words: Its vocabulary.
        facets: What its tokens are taught to hold.
        keep: What it is given.
        cameras: Of its views.
    """

    def __init__(
        self,
        network: CompactBevLlm,
        words: QuestionWordTable,
        of: Facets,
        cameras: Sequence[Camera],
        keep: Keep = "full",
    ) -> None:
        """Args: the network, its vocabulary, its facets, the cameras of its views, and what it is given."""
        self.network, self.words, self.facets = network, words, of
        self.keep: Keep = keep
        self.cameras = tuple(cameras)
        self._rig = rig_tensors(rig_geometry(self.cameras, network.config.patches, network.config.fusion.grid))

    def keeping(self, keep: Keep) -> CompactAnswerer:
        """The same network, given less."""
        return CompactAnswerer(self.network, self.words, self.facets, self.cameras, keep)

    def tokens(
        self,
        now: NDArray[np.uint8],
        past: NDArray[np.uint8],
        motion: NDArray[np.float32],
        keep: Keep | None = None,
    ) -> tuple[torch.Tensor, torch.Tensor | None]:
        """`CompactBevLlm.see` of some scenes, whose arrays are rows of those of QaTensors."""
        shown, before = (_shown(one) for one in (now, past))
        given: Keep = self.keep if keep is None else keep
        return self.network.see(shown, before, self._rig, torch.from_numpy(motion), given)

    def all_features(self, data: QaTensors, scenes: int = 24) -> tuple[torch.Tensor, torch.Tensor]:
        """Encode all scenes of a split, in half precision: see `CompactBevLlm.encode`."""
        found: list[tuple[torch.Tensor, torch.Tensor]] = []
        with torch.no_grad():
            for start in range(0, len(data.truth), scenes):
                part = slice(start, start + scenes)
                shown, before = (_shown(one) for one in (data.now[part], data.past[part]))
                present, earlier = self.network.encode(shown, before, self.keep)
                found.append((present.half(), earlier.half()))
        present, earlier = (torch.cat(one) for one in zip(*found, strict=True))
        return present, earlier

    def gathered(
        self, features: tuple[torch.Tensor, torch.Tensor], motion: NDArray[np.float32], keep: Keep
    ) -> tuple[torch.Tensor, torch.Tensor | None]:
        """`CompactBevLlm.gather` of some scenes' features."""
        present, before = (one.float() for one in features)
        return self.network.gather(present, before, self._rig, torch.from_numpy(motion), keep)

    def all_tokens(self, data: QaTensors, keep: Keep | None = None, scenes: int = 24) -> torch.Tensor:
        """Tokens of all scenes of a split."""
        self.network.eval()
        found: list[torch.Tensor] = []
        with torch.inference_mode():
            for start in range(0, len(data.truth), scenes):
                part = slice(start, start + scenes)
                found.append(self.tokens(data.now[part], data.past[part], data.motion[part], keep)[0])
        return torch.cat(found).clone()

    def scores(self, tokens: torch.Tensor, asked: Sequence[tuple[int, str, Sequence[str], Sequence[float]]]) -> Any:
        """Scores of the options, (questions, 4).

        Args:
            tokens: Of scenes, (scenes, K, hidden).
            asked: Questions: row of the scene, question, options, speeds of the ego.
        """
        texts = [
            self.words.text(question, option, speeds) for _, question, options, speeds in asked for option in options
        ]
        rows = torch.tensor([row for row, _, options, _ in asked for _ in options])
        return _read(self.network, tokens, rows, texts)[0].view(len(asked), -1)

    def choose(self, data: QaTensors, tokens: torch.Tensor | None = None, at_once: int = 32) -> list[int]:
        """Index of the option chosen for each of a split's questions, scene by scene."""
        seen = self.all_tokens(data) if tokens is None else tokens
        asked = [
            (row, item.question, item.options, item.speeds_mps)
            for row, found in enumerate(data.questions)
            for item in found
        ]
        chosen: list[int] = []
        self.network.eval()
        with torch.inference_mode():
            for start in range(0, len(asked), at_once):
                chosen += self.scores(seen, asked[start : start + at_once]).argmax(dim=1).tolist()
        return chosen

    def accuracy(self, data: QaTensors, tokens: torch.Tensor | None = None) -> dict[str, float]:
        """Share of right answers by subtask, and `total`."""
        right: dict[str, list[bool]] = {}
        items = data.items
        for item, chosen in zip(items, self.choose(data, tokens), strict=True):
            right.setdefault(item.subtask, []).append(chosen == item.answer)
        found = {task: sum(right[task]) / len(right[task]) for task in SUBTASKS if task in right}
        return {**found, "total": sum(map(sum, right.values())) / max(1, len(items))}

    def perceived(self, data: QaTensors, tokens: torch.Tensor | None = None) -> dict[str, float]:
        """Share of right classes of each facet, where they are known, by the heads on the tokens."""
        seen = self.all_tokens(data) if tokens is None else tokens
        labels = np.stack([labels_of(truth, self.facets) for truth in data.truth])
        with torch.inference_mode():
            guessed = [logits.argmax(dim=1).numpy() for logits in self.network.classes(seen)]
        found: dict[str, float] = {}
        for place, (name, _) in enumerate(self.facets):
            known = labels[:, place] >= 0
            if known.any():
                found[name] = float((guessed[place] == labels[:, place])[known].mean())
        return found

    def save(self, folder: Path) -> None:
        """Weights in half precision (`model.safetensors`), and all that is needed to use them (`bev_llm.json`)."""
        from safetensors.torch import save_file

        folder.mkdir(parents=True, exist_ok=True)
        state = {name: value.half().contiguous() for name, value in self.network.state_dict().items()}
        save_file(state, folder / "model.safetensors")
        about = {
            "network": self.network.config.json(),
            "words": self.words.words,
            "facets": self.facets,
            "keep": self.keep,
            "cameras": [asdict(camera) for camera in self.cameras],
        }
        (folder / "bev_llm.json").write_text(json.dumps(about), encoding="utf-8")

    @classmethod
    def load(cls, folder: Path) -> CompactAnswerer:
        """A saved network. Raises DataError: there is none in the folder."""
        about = _about(folder)
        network = CompactBevLlm(CompactConfig.of(about["network"]))
        network.load_state_dict(cls.stored_weights(folder))
        cameras = [Camera(**{name: _tuple(value) for name, value in one.items()}) for one in about["cameras"]]
        of = tuple((str(name), tuple(classes)) for name, classes in about["facets"])
        return cls(network.eval(), QuestionWordTable(tuple(about["words"])), of, cameras, about["keep"])

    @staticmethod
    def stored_weights(folder: Path) -> dict[str, torch.Tensor]:
        """Weights of a saved network by name. Raises DataError: there is none in the folder."""
        from safetensors import SafetensorError
        from safetensors.torch import load_file

        try:
            state = load_file(folder / "model.safetensors")
        except (OSError, SafetensorError) as error:
            raise _no_network(folder, error) from error
        return {name: value.float() for name, value in state.items()}


def _no_network(folder: Path, why: Exception) -> DataError:
    return DataError(f"{folder} holds no BEV-LLM: {why}.", hint="Train one: chauffeur model train bev-llm")


def _tuple(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def _shown(pictures: NDArray[np.uint8]) -> torch.Tensor:
    return torch.from_numpy(np.ascontiguousarray(pictures)).float() / 255.0


def _read(
    network: CompactBevLlm, tokens: torch.Tensor, rows: torch.Tensor, texts: Sequence[Sequence[int]]
) -> tuple[torch.Tensor, torch.Tensor]:
    words = torch.full((len(texts), max(map(len, texts))), PAD)
    for place, text in enumerate(texts):
        words[place, : len(text)] = torch.tensor(text)
    return network(tokens[rows], words, (words != PAD).long())


def inherit_weights(answerer: CompactAnswerer, folder: Path) -> None:
    """Take over the weights of a saved network, as far as names and shapes agree; the others stay as they are.

    What it knew of a view or of a class goes to the view or class of that name, wherever these have moved; a view that
    it did not have adds nothing to the gist at first.
    """
    saved, about = CompactAnswerer.stored_weights(folder), _about(folder)
    network, state = answerer.network, answerer.network.state_dict()
    views = [str(camera["name"]) for camera in about["cameras"]]
    patches = saved["gist.patches.weight"].unflatten(1, (len(views), -1))
    own = torch.zeros(len(patches), network.config.views, patches.shape[2])
    for place, camera in enumerate(answerer.cameras):
        if camera.name in views:
            own[:, place] = patches[:, views.index(camera.name)]
    saved["gist.patches.weight"] = own.flatten(1)
    heads = {str(name): (place, [str(one) for one in classes]) for place, (name, classes) in enumerate(about["facets"])}
    taken = {name: value for name, value in saved.items() if not name.startswith("taught.")}
    for place, (name, classes) in enumerate(answerer.facets):
        for part in ("weight", "bias"):
            head = state[f"taught.{place}.{part}"].clone()
            before, known = heads.get(name, (0, []))
            for row, one in enumerate(classes):
                if one in known:
                    head[row] = saved[f"taught.{before}.{part}"][known.index(one)]
            taken[f"taught.{place}.{part}"] = head
    fitting = {name: value for name, value in taken.items() if name in state and state[name].shape == value.shape}
    network.load_state_dict(fitting, strict=False)


def _about(folder: Path) -> dict[str, Any]:
    """All that is needed to use a saved network, besides its weights. Raises DataError: there is none."""
    try:
        return json.loads((folder / "bev_llm.json").read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise _no_network(folder, error) from error


def train_compact(
    folder: Path,
    recipe: BevLlmRecipe,
    train: QaTensors,
    val: QaTensors,
    watch: Watch | None = None,
    every: int = 250,
    begin: Path | None = None,
) -> CompactAnswerer:
    """Train, or go on where a run in this folder stopped; the finished network is saved in `model` below it.

    Args:
        folder: Of the run.
        recipe: What decides it.
        train, val: Splits.
        watch: Is told (stage, step, loss, seconds).
        every: Steps between two lines of metrics.
        begin: A saved network whose weights to begin with, as far as they fit.

    Raises:
        ConfigError: The folder holds a run of another recipe.
        DataError: There is no network to begin with.
    """
    torch.manual_seed(recipe.seed)
    words, of = QuestionWordTable.taught(recipe.half), facets()
    network = CompactBevLlm(compact(recipe, words, of, tuple(train.now.shape[-2:])))
    answerer = CompactAnswerer(network, words, of, train.cameras, recipe.ablation)
    if begin is not None:
        inherit_weights(answerer, begin)
    told: Watch = watch or _unwatched
    plain = {**asdict(recipe), "facets": json.dumps(of), "begin": str(begin or "")}
    how = Optimisation(decay=0.05, precision="float32")
    stage = partial(fit, network, recipe=plain, how=how, every=every, continues=lambda stored, _: _same(stored, plain))

    def perceived(stored: torch.Tensor | None = None) -> Mapping[str, float]:
        return answerer.perceived(val, stored)

    if recipe.steps:
        perception = _Perception(answerer, train, recipe)
        stage(
            batches=perception.batches,
            loss=perception.loss,
            rate=lambda step: _rate(recipe.rate, recipe.steps, step),
            folder=folder / "perception",
            steps=recipe.steps,
            evaluate=perceived,
            watch=partial(told, "perception"),
        )
    gathering: _Gathering | None = None
    if recipe.gather_steps:
        _teach(network, ("fusion", "projector", "gist", "resampler", "taught", "occupied"))
        gathering = _Gathering(answerer, train, recipe)
        stage(
            batches=gathering.batches,
            loss=gathering.loss,
            rate=lambda step: _rate(recipe.gather_rate, recipe.gather_steps, step, _LONG_COOLING),
            folder=folder / "gathering",
            steps=recipe.gather_steps,
            evaluate=perceived,
            watch=partial(told, "gathering"),
        )
    _teach(network, ("decoder", "fits", "means"))
    network.rarity.copy_(_rarity(train, of))
    language = _Language(
        answerer, train, recipe, answerer.all_tokens(train) if gathering is None else gathering.tokens()
    )
    seen = answerer.all_tokens(val)
    stage(
        batches=language.batches,
        loss=language.loss,
        rate=lambda step: _rate(recipe.word_rate, recipe.word_steps, step),
        folder=folder / "language",
        steps=recipe.word_steps,
        evaluate=lambda: answerer.accuracy(val, seen),
        watch=partial(told, "language"),
    )
    answerer.save(folder / "model")
    return answerer


def _rarity(data: QaTensors, of: Facets) -> torch.Tensor:
    """Offsets to the logarithms of the heads' probabilities so that all classes of a facet count alike: of how
    often each one comes, the weights in the loss have evened out a part."""
    labels = torch.from_numpy(np.stack([labels_of(truth, of) for truth in data.truth]))
    found: list[torch.Tensor] = []
    for place, (_, classes) in enumerate(of):
        known = labels[:, place]
        counts = torch.bincount(known[known >= 0], minlength=len(classes)).float() + 1.0
        found.append((1.0 - _EVENED) * (counts.sum() / len(classes) / counts).log())
    return torch.cat(found)


def _teach(network: CompactBevLlm, parts: tuple[str, ...]) -> None:
    """Freeze all but some parts."""
    for name, parameter in network.named_parameters():
        parameter.requires_grad_(name.startswith(parts))


def _unwatched(stage: str, step: int, loss: float, seconds: float) -> None:
    del stage, step, loss, seconds


def _same(stored: Mapping[str, Any], recipe: Mapping[str, Any]) -> bool:
    """True if a stored recipe differs in the number of steps at most: a run may be made longer."""
    apart = ("steps", "gather_steps", "word_steps")
    return {**stored, **dict.fromkeys(apart)} == {**recipe, **dict.fromkeys(apart)}


def _kept(recipe: BevLlmRecipe, rng: np.random.Generator) -> Keep:
    """Inputs kept for a batch: of the full network, three in ten go without history, side views or cells."""
    if recipe.ablation != "full":
        return recipe.ablation
    spared: tuple[Keep, ...] = ("no-history", "single-view", "no-bev")
    return spared[int(rng.integers(3))] if rng.random() < 0.3 else "full"


class _Perception:
    """The first stage."""

    def __init__(self, answerer: CompactAnswerer, data: QaTensors, recipe: BevLlmRecipe) -> None:
        self._answerer, self._data, self._recipe = answerer, data, recipe
        self._labels = torch.from_numpy(np.stack([labels_of(truth, answerer.facets) for truth in data.truth]))
        grid = answerer.network.config.fusion.grid
        self._cells = torch.from_numpy(np.stack([cells_of(truth, grid) for truth in data.truth]))
        self._weights: list[torch.Tensor] = []
        for place, (_, classes) in enumerate(answerer.facets):
            known = self._labels[:, place]
            counts = torch.bincount(known[known >= 0], minlength=len(classes)).float() + 1.0
            self._weights.append((counts.sum() / len(classes) / counts) ** _EVENED)

    def batches(self, first: int) -> Iterator[tuple[Any, ...]]:
        step, data = first, self._data
        while True:
            rng = np.random.default_rng([self._recipe.seed, step])
            rows = rng.choice(len(data.truth), min(self._recipe.scenes, len(data.truth)), replace=False)
            now, past = _varied(data.now[rows], data.past[rows], rng)
            yield rows, now, past, data.motion[rows], _kept(self._recipe, rng)
            step += 1

    def loss(self, batch: tuple[Any, ...]) -> torch.Tensor:
        rows, now, past, motion, keep = batch
        tokens, cells = self._answerer.tokens(now, past, motion, keep)
        return self.truth_loss(rows, tokens, cells)

    def truth_loss(self, rows: Any, tokens: torch.Tensor, cells: torch.Tensor | None) -> torch.Tensor:
        """Loss of tokens and cells against the ground truth of their scenes."""
        network, labels = self._answerer.network, self._labels[rows]
        losses = [
            cross_entropy(logits, labels[:, place], self._weights[place], ignore_index=-1)
            for place, logits in enumerate(network.classes(tokens))
            if bool((labels[:, place] >= 0).any())
        ]
        total = torch.stack(losses).mean()
        if cells is None:
            return total
        guessed = network.occupied(cells).flatten(0, 1)
        weights = torch.ones(network.config.kinds)
        weights[0] = _EMPTY_WEIGHT
        return total + _CELLS_SHARE * cross_entropy(guessed, self._cells[rows].flatten(), weights, ignore_index=-1)


class _Gathering(_Perception):
    """The second stage: what is behind the encoder, from features that are computed once."""

    def __init__(self, answerer: CompactAnswerer, data: QaTensors, recipe: BevLlmRecipe) -> None:
        super().__init__(answerer, data, recipe)
        answerer.network.eval()
        self._present, self._before = answerer.all_features(data)

    def batches(self, first: int) -> Iterator[tuple[Any, ...]]:
        step, count = first, len(self._data.truth)
        while True:
            rng = np.random.default_rng([self._recipe.seed, 2, step])
            rows = rng.choice(count, min(self._recipe.gather_scenes, count), replace=False)
            yield rows, _kept(self._recipe, rng)
            step += 1

    def loss(self, batch: tuple[Any, ...]) -> torch.Tensor:
        rows, keep = batch
        tokens, cells = self._gathered(rows, keep)
        return self.truth_loss(rows, tokens, cells)

    def tokens(self, scenes: int = 48) -> torch.Tensor:
        """Tokens of all scenes."""
        self._answerer.network.eval()
        starts = range(0, len(self._data.truth), scenes)
        with torch.no_grad():
            found = [self._gathered(slice(at, at + scenes), self._answerer.keep)[0] for at in starts]
        return torch.cat(found)

    def _gathered(self, rows: Any, keep: Keep) -> tuple[torch.Tensor, torch.Tensor | None]:
        features = self._present[rows], self._before[rows]
        return self._answerer.gathered(features, self._data.motion[rows], keep)


class _Language:
    """The third stage: questions about scenes whose tokens are known."""

    def __init__(self, answerer: CompactAnswerer, data: QaTensors, recipe: BevLlmRecipe, tokens: torch.Tensor) -> None:
        self._answerer, self._data, self._recipe, self._tokens = answerer, data, recipe, tokens
        self._classes = {
            (name, value): place
            for place, (name, value) in enumerate((name, value) for name, all_of in answerer.facets for value in all_of)
        }
        self._scenes: dict[tuple[str, str], dict[str, list[int]]] = {}
        for row, truth in enumerate(data.truth):
            for family, side, value in truth["facts"]:
                self._scenes.setdefault((family, side), {}).setdefault(value, []).append(row)

    def batches(self, first: int) -> Iterator[tuple[Any, ...]]:
        step, families = first, list(self._scenes)
        while True:
            rng = np.random.default_rng([self._recipe.seed, 1, step])
            rows: list[int] = []
            texts: list[list[int]] = []
            right: list[int] = []
            meant: list[int] = []
            for _ in range(self._recipe.questions):
                family, side = families[int(rng.integers(len(families)))]
                scenes = self._scenes[family, side]
                value = list(scenes)[int(rng.integers(len(scenes)))]
                row = scenes[value][int(rng.integers(len(scenes[value])))]
                question, options, answer, classes = phrase(
                    Fact(family, side, value), self._data.truth[row]["motion"], self._recipe.half, rng
                )
                speeds = self._data.speeds_mps[row].tolist()
                rows += [row] * len(options)
                texts += [self._veiled(self._answerer.words.text(question, text, speeds), rng) for text in options]
                right.append(answer)
                meant += [self._classes[f"{family} {side}".strip(), one] for one in classes]
            yield rows, texts, right, meant
            step += 1

    def _veiled(self, text: list[int], rng: np.random.Generator) -> list[int]:
        """A text with some words unknown."""
        strange = rng.random(len(text)) < _UNKNOWN_WORDS
        return [
            2 + int(rng.integers(STRANGE)) if veiled and token >= 2 else token
            for token, veiled in zip(text, strange, strict=True)
        ]

    def loss(self, batch: tuple[Any, ...]) -> torch.Tensor:
        rows, texts, right, meant = batch
        scores, found = _read(self._answerer.network, self._tokens, torch.tensor(rows), texts)
        answers = cross_entropy(scores.view(len(right), -1), torch.tensor(right))
        return answers + _MEANING_SHARE * nll_loss(found, torch.tensor(meant))


def _varied(
    now: NDArray[np.uint8], past: NDArray[np.uint8], rng: np.random.Generator
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Pictures a little brighter or darker, and shifted by a pixel or two, all of a scene alike."""
    gain = rng.uniform(0.85, 1.15, (len(now), 1, 1, 1, 1)).astype(np.float32)
    shift = (int(rng.integers(-1, 2)), int(rng.integers(-2, 3)))

    def changed(pixels: NDArray[np.uint8], gains: NDArray[np.float32]) -> NDArray[np.uint8]:
        return np.clip(np.roll(pixels, shift, axis=(-2, -1)) * gains, 0.0, 255.0).astype(np.uint8)

    return changed(now, gain), changed(past, gain[:, None])


def _rate(highest: float, steps: int, step: int, cooling: float = _COOLING) -> float:
    """Warmed up, constant, and linearly down over the last share: a run that is made longer has lost little."""
    left = (steps - step) / (cooling * steps)
    return highest * min(1.0, (step + 1) / _WARM_STEPS, max(left, 0.02))
