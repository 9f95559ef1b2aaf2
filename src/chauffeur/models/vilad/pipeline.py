# pyright: reportMissingImports=false
"""From a seed to the models that ship: training, export in 8 bits, figures on four splits, cards.

folder/training/    the network's state and log
folder/model/       what ships: `model.onnx`, `model.json`, `MODEL_CARD.md`
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from chauffeur.driving.files import publish
from chauffeur.models.vilad.baseline import COMMANDS, linear_reader
from chauffeur.models.vilad.evaluation import ViladCase, ViladFigures, figures, solved
from chauffeur.models.vilad.phrases import TESTS, Split
from chauffeur.planners.vilad.engine import ViladEngine
from chauffeur.planners.vilad.unmasking import Unmasking
from chauffeur.planners.word_table import SHIPPED_WORDS, load_words

if TYPE_CHECKING:
    from chauffeur.models.vilad.network import Vilad
    from chauffeur.models.vilad.recipe import ViladRecipe

Told = Callable[[str, int, int], None]
"""Is told (stage, done, of how many)."""

PARKING_VERSION: Final = "vilad-parking-v1"
TEST_SEED: Final = 1
"""Of the test commands and their scenes; training draws from others."""
TEST_COMMANDS: Final = 300


@dataclass(frozen=True, slots=True)
class ViladModel:
    """One of the models that ship.

    Attributes:
        name: As it is asked for: `chauffeur model train`.
        version: Of the model.
        task: What it learns (`recipe.ViladTask`, `baseline.LearnableTask`).
        cases: Test cases of (split, how many, seed).
        how: How it is unmasked.
        full: Share of the samples that are fully masked in training.
        card: What it does, what it is given, what success means: paragraphs of its card.
    """

    name: str
    version: str
    task: Any
    cases: Callable[[Split, int, int], Sequence[ViladCase]]
    how: Unmasking
    full: float
    card: tuple[str, str, str]


def parking_model() -> ViladModel:
    """The model that chooses parking spots."""
    from chauffeur.models.vilad.parking_recipe import PARKING, cases
    from chauffeur.planners.vilad.planner import HOW

    return ViladModel(
        "vilad-parking",
        PARKING_VERSION,
        PARKING,
        cases,
        HOW,
        0.5,
        (
            "Chooses a parking spot for a wish, on board, offline",
            "- **Input**: the words; for each free spot of the lot distances to lift, stairs, pay machine, building,\n"
            "  exit and entrance, the drive there, neighbours, kind of bay, roof, end of row. **Output**: what was\n"
            "  understood, and the spot.",
            "among the best spots for what was meant, within 2 m of walking, all conditions kept",
        ),
    )


def driving_model() -> ViladModel:
    """The model that writes waypoints for short drives."""
    from chauffeur.models.vilad.driving_recipe import DRIVING, drive_cases
    from chauffeur.planners.vilad.driving_planning import HOW_DRIVEN

    return ViladModel(
        "vilad-drive",
        "vilad-drive-v1",
        DRIVING,
        drive_cases,
        HOW_DRIVEN,
        0.7,
        (
            "Writes the waypoints of a short drive on open road for a command, on board, offline",
            "- **Input**: the words; the ways on, with the junction on them, and crosswalks, junction, cones and\n"
            "  parked vehicles along them, by kind and station; the car's speed. **Output**: what was understood, the\n"
            "  way, what to stop by, 10 waypoints 2 s apart as distances along the way in steps of 0.5 m, and the\n"
            "  offset to the right in the end.",
            "the way that was meant, its end within 2 m, at the kerb or in the lane, the pace; no drive where there is "
            "no such way or mark or no room",
        ),
    )


MODELS: Final[dict[str, Callable[[], ViladModel]]] = {"vilad-parking": parking_model, "vilad-drive": driving_model}


def make_model(model: ViladModel, folder: Path, recipe: ViladRecipe, told: Told, base: Path | None = None) -> Path:
    """Train, export, measure and describe; the folder of what ships.

    Args:
        model: Which.
        folder: Of the run.
        recipe: How it is trained.
        told: Is told what is done.
        base: What training begins with: folder of a run on another task, or of a model that ships.

    Raises:
        ConfigError: The folder holds a run of another recipe, or the recipe is the twin's, which does not ship.
        DataError: The bank of phrases or the word table cannot be read.
    """
    from chauffeur.models.vilad.recipe import train

    network = train(
        folder / "training",
        model.task,
        recipe,
        load_words(SHIPPED_WORDS),
        lambda step, loss, seconds: told(f"training, loss {loss:.3f}, {seconds:.2f} s", step + 1, recipe.steps),
        base=base if base is None or (base / "model.onnx").exists() else base / "training",
    )
    return ship(model, network, recipe, folder / "model", told)


def ship(model: ViladModel, network: Vilad, recipe: ViladRecipe, target: Path, told: Told) -> Path:
    """Export a trained network, measure and describe it; the folder of what ships."""
    from chauffeur.models.net.transformer import parameter_count
    from chauffeur.models.vilad.export import export

    about: dict[str, Any] = {
        "version": model.version,
        "length": model.task.template.length,
        "recipe": asdict(recipe),
        "parameters": parameter_count(network),
    }
    export(network, target, about)
    found, baseline = measured(model, target, told)
    about["figures"] = {split: asdict(one) for split, one in found.items()}
    about["linear_reader_and_solver"] = baseline
    publish(target / "model.json", (json.dumps(about, indent=1) + "\n").encode(), "model's facts")
    size = (target / "model.onnx").stat().st_size
    publish(target / "MODEL_CARD.md", model_card(model, about, size).encode(), "model card")
    return target


def measured(
    model: ViladModel, folder: Path, told: Told, count: int = TEST_COMMANDS, seed: int = TEST_SEED
) -> tuple[dict[Split, ViladFigures], dict[Split, tuple[float, float]]]:
    """(figures of a model folder, (success, understood) of the linear reader with the solver), by split."""
    engine = ViladEngine(folder)
    read = linear_reader(model.task, TEST_SEED + 1, told=lambda done, of: told("linear reader", done, of))
    found: dict[Split, ViladFigures] = {}
    baseline: dict[Split, tuple[float, float]] = {}
    for done, split in enumerate(TESTS, start=1):
        tests = model.cases(split, count, seed)
        found[split], baseline[split] = figures(engine, tests, model.how, model.task.criteria), solved(read, tests)
        told("tests", done, len(TESTS))
    return found, baseline


def model_card(model: ViladModel, about: dict[str, Any], size: int) -> str:
    """The model card.

    Args:
        model: Which.
        about: What `model.json` says.
        size: Bytes of the graph.
    """
    recipe: dict[str, Any] = about["recipe"]
    what, given, success = model.card
    rows = "".join(
        f"| {split} | {one['success']:.1f} | {one['verified']:.1f} | {one['solved']:.1f} | "
        f"{one['understood']:.1f} | {one['faithful']:.1f} | "
        f"{one['consistent']:.1f} | {one['driven_consistent']:.1f} | {one['passes']:.1f} | {one['latency_ms']:.0f} | "
        f"{about['linear_reader_and_solver'][split][0]:.1f} |\n"
        for split, one in about["figures"].items()
    )
    begun = f"\n  (`--base`: begun with the reading of {recipe['base']})" if recipe.get("base") else ""
    samples = recipe["steps"] * recipe["batch"]
    bank = "driving.txt" if model.name == "vilad-drive" else "parking.txt"
    return f"""# Model card: {about["version"]}

{what}: masked diffusion over a fixed pattern (ViLaD, paper Sec. VII).
{about["parameters"] / 1e6:.2f} million weights, {size / 1e6:.1f} MB in int8 for ONNX Runtime, and a word table of
2.3 MB (input embeddings of all-MiniLM-L6-v2, Apache-2.0, reduced to 96 components of 8 bits).

{given}
- **Training**: {recipe["steps"]:,} steps of {recipe["batch"]} commands ({samples:,} commands, each in a fresh scene),
  fixed-pattern training (Eq. 29-30), {recipe["full"]:.0%} of them fully masked, seed {recipe["seed"]}. Again:
  `chauffeur model train {model.name} --out DIR --steps {recipe["steps"]} --seed {recipe["seed"]}`{begun}
- **Data**: commands composed from `data/vilad/{bank}`, scenes drawn in the geometry of the simulated world. All
  simulated. See the data card there for how writers are held apart.
- **Figures**, {TEST_COMMANDS} commands a split, percent; success: {success};
  alone: the network's own answer; driven: made to agree with what it says it understood; faithful and consistent: the
  network's own answer does what it says it understood, and its parts fit together; "read + solver": the exact solver on
  what the network says it understood, its pointers and waypoints unused; the last column is a linear reader trained on
  {COMMANDS:,} commands with the exact solver. **The judge is that solver too**, so success measures how words are read:

| split | alone | driven | read + solver | understood | faithful | consistent | both, driven | passes | ms | reader |
|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|
{rows}
- **Not for** anything else: checks and shield stand between it and the car.
"""


def recipe_of(model: ViladModel, size: str, mode: str, steps: int, seed: int, *, begun: bool = False) -> ViladRecipe:
    """A recipe from the words of a command line. Raises ConfigError for an unknown one."""
    from chauffeur.concept import ConfigError
    from chauffeur.models.vilad.network import SIZES
    from chauffeur.models.vilad.recipe import ViladRecipe

    if size not in SIZES:
        raise ConfigError(f"There is no size {size!r}.", hint=f"Sizes: {', '.join(SIZES)}.")
    if mode not in ("fixed", "plain"):
        raise ConfigError(f"There is no way to train called {mode!r}.", hint="Use fixed or plain.")
    base = PARKING_VERSION if begun else ""
    return ViladRecipe(size=size, mode=mode, steps=steps, seed=seed, full=model.full, base=base)
