# pyright: reportMissingImports=false
"""From a seed to the VLM that ships: pictures, training, export in 8 bits and in full, figures, cards.

folder/pictures/    rendered, with what is true of each
folder/training/    the network's state and log
folder/full/        the model in float32, for comparison
folder/model/       what ships: `model.onnx`, `model.json`, `styles.npz`, `head.npz`, `MODEL_CARD.md`
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import numpy as np

from chauffeur.driving.files import publish
from chauffeur.models.sorting.training import write
from chauffeur.models.vlm.config import VlmRecipe
from chauffeur.models.vlm.ear import HEAD_SHARE, NETWORK_SHARE, style_head, style_sorter, style_worth
from chauffeur.models.vlm.evaluation import VlmFigures, vlm_figures
from chauffeur.models.vlm.gains import gain_table
from chauffeur.models.vlm.recipe import train
from chauffeur.models.vlm.scenes import PictureSet, Split, load_pictures, make_pictures
from chauffeur.models.vlm.wishes import held_wishes
from chauffeur.planners.camera_faults import HEIGHT, WIDTH
from chauffeur.planners.vlm.engine import TRUST, VlmEngine
from chauffeur.planners.vlm.sentences import shipped_encoder
from chauffeur.planners.vlm.template import SEEN_WEATHERS, TEMPLATE, GainCodebook
from chauffeur.planners.word_table import SHIPPED_WORDS, load_words
from chauffeur.safety.gain_box import gain_box

Told = Callable[[str, int, int], None]
"""Is told (stage, done, of how many)."""

VERSION: Final = "vlm-compact-v2"
TESTS: Final[Mapping[Split, int]] = {"test": 500, "held_out_a": 250, "held_out_b": 250}
"""Pictures of each test."""
TEST_SEED: Final = 1


def make_vlm(folder: Path, recipe: VlmRecipe, told: Told, tests: Mapping[Split, int] = TESTS) -> Path:
    """Render, train, export, measure and describe; the folder of what ships.

    Args:
        folder: Of the run; what is there is gone on with.
        recipe: What decides the training.
        told: Of progress.
        tests: Pictures of each test.

    Raises:
        ConfigError: The folder holds a run of another recipe.
        DataError: Sentences, gains or pictures cannot be read.
    """
    from chauffeur.models.net.transformer import parameter_count
    from chauffeur.models.vlm.export import export

    pictures = folder / "pictures"
    make_pictures(pictures, "train", recipe.scenes, told)
    for split, count in tests.items():
        make_pictures(pictures, split, count, told)
    model = train(
        folder / "training",
        recipe,
        load_pictures(pictures, "train", recipe.scenes),
        load_words(SHIPPED_WORDS),
        lambda stage, step, loss, seconds: told(
            f"{stage}, loss {loss:.3f}, {seconds:.2f} s",
            step + 1,
            recipe.seeing_steps if stage == "eye" else recipe.steps,
        ),
    )
    about: dict[str, Any] = {
        "version": VERSION,
        "tokens": list(TEMPLATE.words),
        "codebook": {name: list(values) for name, values in GainCodebook.of(gain_box()).values.items()},
        "gains": gain_table()["version"],
        "recipe": asdict(recipe),
        "parameters": parameter_count(model),
    }
    about |= {"network_share": NETWORK_SHARE, "head_share": HEAD_SHARE, "style_worth": style_worth()}
    full = export(model, folder / "full", about, int8=False)
    target = export(model, folder / "model", about)
    ear, head = style_sorter(recipe.seed), style_head(recipe.seed, shipped_encoder())
    for path in (full, target):
        write(ear, path / "styles.npz")
        head.store(path / "head.npz")
    engines = {"int8": VlmEngine(target), "float32": VlmEngine(full)}
    sets: dict[Split, PictureSet] = {
        split: load_pictures(pictures, split, count) for split, count in tests.items() if count
    }
    found: dict[str, VlmFigures] = {}
    for done, (split, held) in enumerate(sets.items(), start=1):
        wishes = held_wishes("test", len(held) // len(SEEN_WEATHERS), TEST_SEED)
        found[split] = vlm_figures(engines["int8"], held, wishes)
        if split == "test":
            found["test, float32"] = vlm_figures(engines["float32"], held, wishes)
            found["test, blind"] = vlm_figures(engines["int8"], held, wishes, blind=True)
            found["test, another picture"] = vlm_figures(engines["int8"], _shuffled(held), wishes)
        told("tests", done, len(sets))
    about["figures"] = {name: asdict(one) for name, one in found.items()}
    sizes = {name: (path / "model.onnx").stat().st_size for name, path in (("int8", target), ("float32", full))}
    publish(target / "model.json", (json.dumps(about, indent=1) + "\n").encode(), "model's facts")
    publish(target / "MODEL_CARD.md", model_card(about, sizes).encode(), "model card")
    return target


def _shuffled(pictures: PictureSet) -> PictureSet:
    """The same facts beside pictures of other scenes: what is left when what is shown says nothing."""
    order = np.random.default_rng([TEST_SEED, 23]).permutation(len(pictures))
    return PictureSet(pictures.pixels[order], pictures.cells[order], pictures.facts)


def model_card(about: Mapping[str, Any], sizes: Mapping[str, int]) -> str:
    """The model card.

    Args:
        about: What `model.json` says.
        sizes: Bytes of the graphs, `int8` and `float32`.
    """
    recipe: dict[str, Any] = about["recipe"]
    rows = "".join(
        f"| {name} | {one['count']} | {one['weather']:.1f} | {one['grade']:.1f} | {one['lead']:.1f} | "
        f"{one['road']:.1f} | {one['style']:.1f} | {one['command_alignment']:.1f} | "
        f"{one['scenario_alignment']:.1f} | {one['latency_ms']:.0f} |\n"
        for name, one in about["figures"].items()
    )
    return f"""# Model card: {about["version"]}

The on-board vision-language model of personalised motion control (paper Sec. VI), compact: a picture of the front
camera and a wish in, the style that was heard, what is seen, and six gains out. {about["parameters"] / 1e6:.2f} million
weights, {sizes["int8"] / 1e6:.1f} MB in int8 ({sizes["float32"] / 1e6:.1f} MB in float32) for ONNX Runtime, and the
word table of the ViLaD planner (2.3 MB, input embeddings of all-MiniLM-L6-v2, Apache-2.0). The style is read by two
more: a linear sorter of wishes (0.15 MB), and a head (1.4 MB) on the frozen sentence encoder all-MiniLM-L6-v2
(`encoder.onnx`, 22 MB in int8, Apache-2.0). What the three find is multiplied, the network's with an exponent of
{NETWORK_SHARE}, the head's with {HEAD_SHARE} (tuned on two writers of their own), and the style is taken whose gains
are expected to fit best: in doubt between haste and care, moderate.

- **Input**: {TEMPLATE.length} tokens of a fixed pattern, the words (pieces with pretrained vectors), the picture at
  {WIDTH}x{HEIGHT}. **Output**: style; weather, its grade, lead vehicle, road; Kp, Ki, Kd, Wl, Wh, Ws as tokens of a
  codebook within the certified box. Token by token, each from those before it; the style from the words alone.
- **Training**: first the eye, {recipe["seeing_steps"]:,} steps of {recipe["seen_pictures"]} pictures (what is seen, and
  where vehicles are); then, with the eye frozen, {recipe["steps"]:,} steps of {recipe["pictures"]} pictures with three
  wishes each. {recipe["scenes"]:,} rendered scenes ({3 * recipe["scenes"]:,} pairs a turn; wishes are drawn anew each
  turn), seed {recipe["seed"]}. Again: `chauffeur model train vlm --out DIR --scenes {recipe["scenes"]}
  --steps {recipe["steps"]} --seed {recipe["seed"]}`
- **Data**: rendered, never photographed; sentences of `data/sorters`, `data/onboard` and `data/vlm`, whose card says
  how writers are held apart; gains of the table `data/vlm/gains.json`, which is the authors' own.
- **Figures**, percent (alignments: points), on places, traffic, writers and templates that training did not have;
  `held_out_a` and `held_out_b` have another palette, exposure and lens as well; `another picture` shows the picture of
  another scene:

| test | pairs | weather | grade | lead | road | style | command alignment | scenario alignment | ms |
|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|
{rows}
- **Told** to people is what of this table, on `test`, is right in {TRUST:.0f} percent: not more is said than is seen. A
  figure near that of the blind row is no sight at all: what it says then comes from the manoeuvre it is given.
- **Not for** a real road: it has seen rendered pictures alone. Checks and the certified box stand between it and the
  car, and the planner chooses conservatively where the camera fails.
"""
