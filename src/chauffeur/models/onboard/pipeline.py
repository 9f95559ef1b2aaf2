# pyright: reportMissingImports=false
"""From a seed to a model: cases, examples, tokenizer, network, export; every stage is kept, and a stopped run goes on.

folder/cases.jsonl      scenes and programs, each driven
folder/data/            packed examples of each split, the splits' texts, `data.json`, `DATA_CARD.md`
folder/training/        the network's state and log
folder/model/           what ships: `model.onnx`, `tokenizer.json`, `model.json`
folder/transformers/    the same as a checkpoint for `transformers`
"""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

import numpy as np

from chauffeur.concept import ConfigError, DataError
from chauffeur.driving.files import publish
from chauffeur.models.onboard.cases import Case
from chauffeur.models.onboard.engine import (
    PER_CASE,
    VERSION,
    Splits,
    gathered,
    left_out,
    make_cases,
    processes,
    worded,
)
from chauffeur.models.onboard.examples import Example, checked_reasons, questions, reasons
from chauffeur.models.onboard.packed import Packed
from chauffeur.planners.onboard.prompt import END

MODEL_VERSION: Final = "onboard-lm-v6"
_SPLITS: Final = ("train", "seen", "unseen")
_TOKENIZER_EXAMPLES: Final = 60_000

Told = Callable[[str, int, int], None]
"""Is told (stage, done, of how many)."""


@dataclass(frozen=True, slots=True)
class PipelinePlan:
    """Settings that decide a model.

    Attributes:
        seed: Of everything.
        draws: Draws of cases; about six in ten become one.
        per_case: Wordings tried for each.
        size: Network's size, see `training.SIZES`.
        steps: Optimiser steps.
        more: Steps of a second round after them.
        base: Folder of a finished run, or of a model that ships, whose network is trained on, with its tokenizer, on
            this plan's data; None to begin from nothing. Rate and blanking are then those of a second round.
    """

    seed: int = 0
    draws: int = 30_000
    per_case: int = PER_CASE
    size: str = "small"
    steps: int = 14_000
    more: int = 0
    base: Path | None = None

    @property
    def of_data(self) -> dict[str, Any]:
        """Settings that decide the data, as `data.json` holds it."""
        base = {} if self.base is None else {"tokenizer": _sha256(_words_of(self.base) / "tokenizer.json")}
        return {"seed": self.seed, "draws": self.draws, "per_case": self.per_case} | base


def build_data(folder: Path, plan: PipelinePlan, workers: int, told: Told) -> None:
    """Cases, examples and tokenizer. Raises DataError when a file cannot be written."""
    data = folder / "data"
    facts_file, wanted = data / "data.json", plan.of_data
    if facts_file.exists() and json.loads(facts_file.read_text(encoding="utf-8"))["plan"] == wanted:
        return
    data.mkdir(parents=True, exist_ok=True)
    cases_file = folder / "cases.jsonl"
    cases = make_cases(plan.seed, plan.draws, cases_file, workers, lambda done, _: told("cases", done, plan.draws))
    splits = _examples(cases, plan, workers, told)
    _pack(splits, data, plan, told)
    facts = _facts(cases, splits, left_out(cases_file), plan)
    publish(data / "DATA_CARD.md", data_card(facts).encode(), "data card")
    publish(facts_file, (json.dumps(facts, indent=1, ensure_ascii=False) + "\n").encode(), "data set's facts")


def _examples(cases: Sequence[Case], plan: PipelinePlan, workers: int, told: Told) -> Splits:
    parts = [cases[i : i + 100] for i in range(0, len(cases), 100)]
    found: list[Splits] = []
    with processes(workers) as pool:
        for part in pool.map(partial(worded, seed=plan.seed, per_case=plan.per_case), parts):
            found.append(part)
            told("examples", len(found), len(parts))
    return gathered(found)


def _pack(splits: Splits, data: Path, plan: PipelinePlan, told: Told) -> None:
    from chauffeur.models.onboard.tokens import load_tokenizer, train_tokenizer

    tokenizer: Any
    if plan.base is None:
        rng = np.random.default_rng([plan.seed, 31])
        count = min(_TOKENIZER_EXAMPLES, len(splits.train))
        some = [splits.train[i] for i in sorted(rng.choice(len(splits.train), count, replace=False))]
        tokenizer = train_tokenizer(text for example in some for text in (example.prompt, example.reply))
    else:
        tokenizer = load_tokenizer(_words_of(plan.base))
    tokenizer.save(str(data / "tokenizer.json"))
    end = tokenizer.token_to_id(END)
    for place, (name, examples) in enumerate(zip(_SPLITS, (splits.train, splits.seen, splits.unseen), strict=True)):
        told("tokens", place, len(_SPLITS))
        Packed.of([(example.prompt, example.reply) for example in examples], tokenizer, end).save(data / f"{name}.npz")
        lines = "".join(json.dumps(asdict(example), ensure_ascii=False) + "\n" for example in examples)
        publish(data / f"{name}.jsonl", lines.encode(), "examples")


def _ships(base: Path) -> bool:
    """True if a base is a model as it ships, not the run that made one."""
    return (base / "model.onnx").exists()


def _words_of(base: Path) -> Path:
    """Folder of a base's tokenizer."""
    return base if _ships(base) else base / "data"


def _sha256(file: Path) -> str:
    try:
        return hashlib.sha256(file.read_bytes()).hexdigest()
    except OSError as error:
        raise DataError(
            f"{file} cannot be read.",
            hint="--base is the folder of a finished run of `chauffeur model train onboard`, or of a model that ships.",
        ) from error


def _facts(cases: Sequence[Case], splits: Splits, why: Counter[str], plan: PipelinePlan) -> dict[str, Any]:
    train = splits.train
    skills = Counter(skill for case in cases if not case.refusal for skill in (step.skill for step in case.steps))
    return {
        "version": VERSION,
        "chauffeur": version("chauffeur"),
        "plan": plan.of_data,
        "cases": len(cases),
        "cases_refused": sum(bool(case.refusal) for case in cases),
        "left_out": dict(why.most_common()),
        "examples": {name: len(part) for name, part in zip(_SPLITS, (train, splits.seen, splits.unseen), strict=True)},
        "kinds": dict(Counter(example.kind for example in train).most_common()),
        "directness": dict(sorted(Counter(example.directness for example in train).items())),
        "noise": dict(sorted(Counter(example.noise for example in train).items())),
        "steps": dict(sorted(Counter(example.skills.count("+") + 1 for example in train).items())),
        "wordings": len({example.wish for example in train}),
        "templates": len({part for example in train for part in example.template.split("+")}),
        "driven_skills": dict(skills.most_common()),
        "sha256": hashlib.sha256("".join(example.prompt + example.reply for example in train).encode()).hexdigest(),
    }


def data_card(facts: dict[str, Any]) -> str:
    """The data card of a data set."""

    def table(head: str, counts: dict[Any, int]) -> str:
        return f"| {head} | count |\n|---|---:|\n" + "".join(f"| {k} | {n:,} |\n" for k, n in counts.items())

    return f"""# Data card: {facts["version"]}

Training data of the on-board language model: {facts["examples"]["train"]:,} examples of (wish, situation, remembered
trips) -> (program, what it does), made by this repository alone. All scenes are simulated (highway-env physics), all
words come from a grammar; no person's data is in it, and no sentence of LaMPilot's or of the hand-written test set.

- **Cases**: {facts["cases"]:,} scenes with a program each ({facts["cases_refused"]:,} of them not possible there, whose
  answer is a refusal). Every other program was linked, driven in its scene and did what its words say; what did not was
  left out (table below).
- **Words**: {facts["wordings"]:,} different wishes from {facts["templates"]:,} templates; about a seventh of those
  of each skill is held out for tests. Typing and speech-recognition errors in three levels. In training
  alone, words are exchanged for others of the same meaning, and sentences stand beside the wish: its reason, or talk
  about something else.
- **Near-duplicates**: no prompt comes twice, and no wording (numbers and politeness masked) more than 24 times for the
  same program; test wishes whose masked wording occurs in training are left out.
- **Seed** {facts["plan"]["seed"]}; sha256 of the training examples `{facts["sha256"][:16]}`.

{table("kind", facts["kinds"])}
{table("directness (0: not varied)", facts["directness"])}
{table("noise level", facts["noise"])}
{table("things to do in a wish", facts["steps"])}
{table("skill, in driven cases", facts["driven_skills"])}
{table("draws left out because", dict(list(facts["left_out"].items())[:30]))}
## Limits

English only, one grammar's idea of how people speak, LaMPilot's three roads, one weather. Moods ("I am late") stand for
the one skill that a reasonable driver would choose.
"""


def train_model(folder: Path, plan: PipelinePlan, told: Told, *, threads: int = 0, device: str = "") -> Path:
    """Train on built data, and export; gives the folder of what ships.

    Raises:
        ConfigError: The folder holds a training run of another plan, or the base is not a finished run of this size.
        DataError: There is no built data.
    """
    import torch

    from chauffeur.models.onboard.export import export, export_transformers
    from chauffeur.models.onboard.tokens import blanks_of, load_tokenizer
    from chauffeur.models.onboard.training import Recipe, train

    data = folder / "data"
    if not (data / "data.json").exists():
        raise DataError(
            f"{folder} holds no data to train on.", hint="Build it first: chauffeur model train onboard --data-only"
        )
    if threads:
        torch.set_num_threads(threads)
    tokenizer: Any = load_tokenizer(data)
    state = folder / "training"
    state.mkdir(exist_ok=True)
    recipe, begin = Recipe(size=plan.size, steps=plan.steps, seed=plan.seed, more=plan.more), None
    lineage: dict[str, Any] = {}
    if plan.base is not None:
        size, begin, lineage = _begun_with(plan.base)
        if plan.more or size != plan.size:
            raise ConfigError("A network is trained on in its own size, in one round.", hint="Leave out --more.")
        recipe = Recipe.onwards(f"{lineage['version']}/{lineage['data'][:16]}", plan.size, plan.steps, plan.seed)
    model = train(
        Packed.load(data / "train.npz"),
        state,
        recipe,
        vocabulary=tokenizer.get_vocab_size(),
        end=tokenizer.token_to_id(END),
        blanks=blanks_of(tokenizer),
        held_back=Packed.load(data / "unseen.npz"),
        watch=lambda step, loss, rate: told(
            f"training, loss {loss:.3f}, {rate:,.0f} tokens/s", step + 1, recipe.all_steps
        ),
        device=device,
        begin=begin,
    )
    facts = json.loads((data / "data.json").read_text(encoding="utf-8"))
    about = {
        "version": MODEL_VERSION,
        "recipe": asdict(recipe),
        "data": facts["sha256"],
        "base": lineage or None,
        "questions": list(questions()),
        "reasons": list(reasons()),
        "checked": list(checked_reasons()),
    }
    export(model, tokenizer, folder / "model", about)
    count = sum(parameter.numel() for parameter in model.parameters())
    publish(folder / "model" / "MODEL_CARD.md", model_card(about, facts, count).encode(), "model card")
    publish(folder / "model" / "DATA_CARD.md", data_card(facts).encode(), "data card")
    export_transformers(model, tokenizer, folder / "transformers")
    return folder / "model"


def _begun_with(base: Path) -> tuple[str, Any, dict[str, Any]]:
    """(size, weights, what is remembered of it) of the network that a run begins with."""
    from chauffeur.models.onboard.shipped import shipped_weights
    from chauffeur.models.onboard.training import finished

    if _ships(base):
        about: dict[str, Any] = json.loads((base / "model.json").read_text(encoding="utf-8"))
        begin, plan = shipped_weights(base), None
    else:
        _, begin = finished(base / "training")
        about = json.loads((base / "model" / "model.json").read_text(encoding="utf-8"))
        plan = json.loads((base / "data" / "data.json").read_text(encoding="utf-8"))["plan"]
    kept = {name: about[name] for name in ("version", "recipe", "data")}
    return about["recipe"]["size"], begin, {**kept, "base": about.get("base"), "plan": plan}


def model_card(about: dict[str, Any], facts: dict[str, Any], parameters: int) -> str:
    """The model card of a trained model.

    Args:
        about: What `model.json` says.
        facts: What `data.json` says of the data.
        parameters: How many the network has.
    """
    recipe, base = about["recipe"], about.get("base")
    steps = recipe["steps"] + recipe["more"]
    tokens = steps * recipe["batch_tokens"] / 1e6
    made = f"--draws {facts['plan']['draws']} --per-case {facts['plan']['per_case']}"
    command = (
        f"chauffeur model train onboard --out DIR --size {recipe['size']}\n"
        f"  --steps {recipe['steps']} --more {recipe['more']} --seed {recipe['seed']}\n  {made}"
    )
    more = f"the last\n  {recipe['more']:,} of them a second round at half the rate,"
    rounds = more if recipe["more"] else "in one round,"
    blanked = f"{recipe['blanked']:.0%} of the words"
    if recipe["more"]:
        blanked += f" ({recipe['blanked_more']:.0%} in the second round)"
    lineage = ""
    if base is not None:
        earlier = base["recipe"]
        command = (
            f"chauffeur model train onboard --out DIR --base BASE --size {recipe['size']}\n"
            f"  --steps {recipe['steps']} --seed {recipe['seed']} {made}"
        )
        made_by = _made_by(base)
        lineage = f"""
- **Trained on from** `{base["version"]}` ({earlier["steps"] + earlier["more"]:,} steps on data `{base["data"][:16]}`),
  whose tokenizer it keeps: the numbers above are of the training since. `BASE` is {made_by}."""
    return f"""# Model card: {about["version"]}

Writes driving programs for passengers' wishes, on board, offline. {parameters / 1e6:.1f} million parameters, Llama
architecture (`{recipe["size"]}`), int8 weights for ONNX Runtime, trained from nothing by this repository.

- **Input**: situation and remembered trips in a few words, the wish (English, one sentence or a few), and what the
  rule-based reader made of it. **Output**: a program of the dialect and one sentence that says the same, a question
  back, or a reason to refuse.
- **Training**: {steps:,} steps of {recipe["batch_tokens"]:,} tokens ({tokens:.0f} M with padding), {rounds} on
  {facts["examples"]["train"]:,} examples; AdamW, rate {recipe["rate"]}, decay {recipe["decay"]},
  {blanked} blanked in half of the
  examples; seed {recipe["seed"]}.
  Data `{about["data"][:16]}`: see `DATA_CARD.md`.
  The same command makes it again: `{command}`.{lineage}
- **Meant for** the `onboard` planner of Chauffeur, behind its grammar, guard, linking and checks, in simulation. Alone
  it has none of them: it may copy a number wrongly or mistake a wish, more often on phrasings unlike its grammar's.
- **Not for** a vehicle on a road, other languages, conversations, or any task but this one.
- **Figures**: `benchmarks/RESULTS.md` of the repository: LaMPilot-Bench, hand-written wishes, phrasings seen and not
  seen in training, ablations, latency.
- **Licence** and data: those of the repository; no third-party text, no personal data.
"""


def _made_by(base: dict[str, Any]) -> str:
    earlier, plan = base["recipe"], base["plan"]
    if plan is None:
        return "the folder of its weights, as that version\n  of the package shipped them"
    return (
        "that version's folder, made by the\n"
        f"  version of this repository that shipped it: `chauffeur model train onboard --out BASE\n"
        f"  --size {earlier['size']} --steps {earlier['steps']} --more {earlier['more']} --seed {earlier['seed']}\n"
        f"  --draws {plan['draws']} --per-case {plan['per_case']}`"
    )


def examples_of(path: Path) -> list[Example]:
    """The stored examples of a split."""
    return [Example(**json.loads(line)) for line in path.read_text(encoding="utf-8").splitlines()]
