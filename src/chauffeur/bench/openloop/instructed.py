"""Open-loop planning with instructions: does a model drive as it is told to (doScenes, arXiv 2412.05893)?

As in doScenes' Instructed Driving Challenge (mi3-lab.github.io/doScenes_challenge, and `metrics.py` of its repository):
a scene is asked about once, at its first sample with 2 s before it (the fifth key frame) and 6 s after it; twelve
waypoints at 2 Hz. ADE is the mean L2 distance of the twelve, FDE that of the last, the gain by the instruction ADE
without it minus ADE with it. The challenge leaves the 2.5 % of scenes with the highest ADE out of its means (Q97.5).

A model is asked once a scene without instruction, and once for each instruction. It is shown no navigation, which would
be read off the very future that is asked for. The instruction is privileged in the same way: annotators had seen the
whole scene, of which 6 s are asked for.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from chauffeur.bench.kernel.benchmark import ItemOutcome
from chauffeur.bench.kernel.metrics import AnyRow, Measure, TableSpec, mean, register, share
from chauffeur.bench.kernel.stats import Array
from chauffeur.bench.kernel.store import Row
from chauffeur.bench.openloop.benchmark import OpenLoopBenchmark, OpenLoopItem, OpenLoopStatus, read_answer
from chauffeur.bench.openloop.conventions import distances, standing
from chauffeur.bench.openloop.doscenes import INSTRUCTION_KINDS, SceneInstruction, read_annotations
from chauffeur.bench.openloop.extrapolation import constant_turn_and_acceleration, constant_velocity
from chauffeur.bench.openloop.nuscenes import PlanningSample
from chauffeur.bench.openloop.requests import OpenLoopSetting
from chauffeur.concept import ConfigError, DataError
from chauffeur.driving.files import publish

if TYPE_CHECKING:
    from numpy.typing import NDArray

    FloatArray = NDArray[np.float64]

STEPS: Final = 12
"""Waypoints: 6 s."""
_SHOWN: Final = 20
"""Lines of what was left out on the console; all are in the run folder."""
KEPT: Final = 0.975
"""Share of the scenes, those with the lowest ADE, in the challenge's means."""
HISTORY_ONLY: Final = "history only"
"""Kind of the rows without an instruction."""
MODEL: Final = "model"
_WORDLESS: Final[Mapping[str, Callable[[FloatArray, int], FloatArray]]] = {
    "constant velocity": constant_velocity,
    "constant turn and acceleration": constant_turn_and_acceleration,
}
"""Baselines that read no words."""


@dataclass(frozen=True, slots=True)
class InstructedRow:
    """One method at one item.

    Attributes:
        item: Token of the sample, and place of the instruction.
        scene: Its name.
        kind: What the instruction refers to, or `history only`.
        method: `model`, or a baseline that reads no words.
        instruction: The words.
        setting, shown: How it was asked, and whether the picture was the real one.
        status: What became of it; `no answer` counts nowhere.
        detail: Why there is none.
        ade_m, fde_m: With the instruction; of an unreadable answer those of a car that stays.
        status_without, ade_without_m, fde_without_m: The same method in the same scene without it; None until it has
            been asked.
        kept, kept_without: Whether the scene is among the 97.5 % with the lowest ADE of the method.
        answer: The model's words.
    """

    item: str
    scene: str
    kind: str
    method: str
    instruction: str
    setting: str
    shown: str
    status: OpenLoopStatus
    detail: str
    ade_m: float | None
    fde_m: float | None
    status_without: OpenLoopStatus | None
    ade_without_m: float | None
    fde_without_m: float | None
    kept: bool | None
    kept_without: bool | None
    answer: str


def _compared(row: AnyRow) -> bool:
    """True if a method answered with the instruction and without it: no other row is in any mean."""
    return row["kind"] != HISTORY_ONLY and row["ade_m"] is not None and row["ade_without_m"] is not None


def _mean(name: str, title: str, of: Callable[[AnyRow], float]) -> Measure:
    return mean(f"instructed-{name}-v1", title, "m", lambda row: of(row) if _compared(row) else None, 2)


def _unreadable(name: str, title: str, column: str) -> Measure:
    """Share of the model's answers that are no waypoints: where the two shares differ, the gain is of form too."""
    return share(
        f"instructed-{name}-v1", title, lambda row: row[column] == "unreadable" if row["method"] == MODEL else None, 2
    )


_GAINS: Final = (
    _mean("ade", "ADE", lambda row: row["ade_m"]),
    _mean("ade-without", "ADE without", lambda row: row["ade_without_m"]),
    _mean("ade-gain", "gain ADE", lambda row: row["ade_without_m"] - row["ade_m"]),
    _mean("fde", "FDE", lambda row: row["fde_m"]),
    _mean("fde-without", "FDE without", lambda row: row["fde_without_m"]),
    _mean("fde-gain", "gain FDE", lambda row: row["fde_without_m"] - row["fde_m"]),
    _unreadable("unreadable", "no waypoints", "status"),
    _unreadable("unreadable-without", "no waypoints without", "status_without"),
)


def _kept(row: AnyRow) -> tuple[float, ...] | None:
    """ADE without the instruction and with it, each beside whether it is kept."""
    if row["kept"] is None:
        return None
    before, after = bool(row["kept_without"]), bool(row["kept"])
    return before * row["ade_without_m"], float(before), after * row["ade_m"], float(after)


def _difference(totals: Array) -> Array:
    with np.errstate(invalid="ignore", divide="ignore"):  # nothing is kept: undefined
        return totals[..., 0] / totals[..., 1] - totals[..., 2] / totals[..., 3]


_FILTERED: Final = (
    mean("instructed-ade-kept-v1", "ADE", "m", lambda row: row["ade_m"] if row["kept"] else None, 2),
    mean(
        "instructed-ade-kept-without-v1",
        "ADE without",
        "m",
        lambda row: row["ade_without_m"] if row["kept_without"] else None,
        2,
    ),
    register(Measure("instructed-ade-kept-gain-v1", "gain ADE", _kept, "m", _difference, 2)),
)


_METHODS: Final = (MODEL, *_WORDLESS)


def _by_method(title: str, measures: tuple[Measure, ...]) -> TableSpec:
    heads = ("method", "instructions")
    return TableSpec(title, measures, "method", _METHODS, "scene", _compared, heads, total=False)


def _of_model(row: AnyRow) -> bool:
    return _compared(row) and row["method"] == MODEL


class InstructedBenchmark(OpenLoopBenchmark):
    """Scenes of nuScenes, each without and with what annotators of doScenes would tell the car."""

    id = "openloop-instructed-v1"
    row = InstructedRow
    steps = STEPS
    tables = (
        _by_method(
            "Up to 6 s with an instruction and without; methods that read no words gain 0 by construction", _GAINS
        ),
        TableSpec(
            "The model, by what the instruction refers to",
            _GAINS,
            "kind",
            INSTRUCTION_KINDS,
            "scene",
            _of_model,
            ("refers to", "instructions"),
        ),
        _by_method("The challenge's Q97.5: without the 2.5 % of scenes with the highest ADE", _FILTERED),
    )

    def __init__(self, data: str, instructions: str, setting: OpenLoopSetting = "zero-shot", **options: Any) -> None:
        """Make it.

        Args:
            data: As of OpenLoopBenchmark.
            instructions: doScenes' folder of annotations, or one file.
            setting: `zero-shot` or `chain-of-thought`.
            options: The others of OpenLoopBenchmark; each scene has one frame.

        Raises:
            ConfigError: An option makes no sense.
            DataError: Tables or annotations cannot be read, or have no scene in common.
        """
        if setting == "sft":
            raise ConfigError(
                "The setting sft is for 3 s without instructions.", hint="Choose zero-shot or chain-of-thought."
            )
        self.annotations = read_annotations(Path(instructions))
        self._by_scene: dict[str, list[SceneInstruction]] = defaultdict(list)
        for one in self.annotations.instructions:
            self._by_scene[one.scene].append(one)
        super().__init__(data, setting=setting, **options)
        self.config = {
            **self.config,
            "command": "none",
            "instructions": Path(instructions).name,
            "instructions_sha256": self.annotations.sha256,
        }

    @property
    def left_out(self) -> tuple[str, ...]:
        """Annotations that are not asked about, in words."""
        there = self.tables_read.scenes
        absent = [name for name in self._by_scene if name not in there]
        asked = {one.scene for one in self.samples}
        other = [name for name in self._by_scene if name in there and name not in asked]
        found = [f"Rows without an instruction: {self.annotations.blank}."] if self.annotations.blank else []
        for scenes, what in ((absent, "not in the set"), (other, "not asked for, or without 8 s in one piece")):
            if scenes:
                many = sum(len(self._by_scene[name]) for name in scenes)
                found.append(f"Scenes {what}: {len(scenes)} (instructions: {many}).")
        if self.annotations.malformed:
            found.append(f"Malformed rows: {len(self.annotations.malformed)}.")
        return (*found, *self.annotations.malformed)

    @property
    def variant(self) -> str:
        """Options as the default run folder's name shows them."""
        return "-".join(["instructed", *([super().variant] if super().variant else [])])

    def conclude(self, folder: Path, rows: Sequence[Row], results: Mapping[str, Row | None]) -> Sequence[str]:
        """See Concludes: writes `left_out.txt`, where anything was."""
        del rows, results
        from chauffeur.bench.openloop.frames import SIMULATED  # with cameras, which a run on nuScenes has no need of

        said = list(self.left_out[:_SHOWN])
        if len(self.left_out) > _SHOWN:
            said.append(f"... and {len(self.left_out) - _SHOWN} more, in {folder / 'left_out.txt'}.")
        if self.left_out:
            publish(folder / "left_out.txt", "".join(f"{line}\n" for line in self.left_out).encode(), "run's result")
        said.append(
            "Gain: error without the instruction minus error with it, same model and scene. Annotators had seen the "
            "whole scene: an instruction is privileged, and may be about what comes after the 6 s. No navigation is "
            "shown."
        )
        return [*said, *([SIMULATED] if self.own else [])]

    def asked_about(self, samples: Sequence[PlanningSample]) -> Sequence[PlanningSample]:
        """The first sample of each annotated scene whose 6 s are known. Raises DataError: there is none."""
        found: dict[str, PlanningSample] = {}
        for one in samples:
            if one.scene in self._by_scene and one.whole:
                found.setdefault(one.scene, replace(one, command=""))
        if not found:
            raise DataError(
                f"None of the {len(self._by_scene)} scenes with an instruction is in {self.tables_read.folder} with "
                f"2 s before and 6 s after a sample.",
                hint="doScenes annotates v1.0-trainval and v1.0-test; v1.0-mini has ten scenes of them.",
            )
        return list(found.values())

    def items(self) -> Sequence[OpenLoopItem]:
        """Each scene without an instruction, then with each of its own."""
        found: list[OpenLoopItem] = []
        for sample in self.samples:
            found.append(OpenLoopItem(sample.id, sample))
            for one in self._by_scene[sample.scene]:
                found.append(OpenLoopItem(f"{sample.id} {one.place}", replace(sample, kind=one.kind), one.text))
        return found

    def rows(self, outcome: ItemOutcome[OpenLoopItem]) -> Sequence[InstructedRow]:
        if outcome.answer is None and not outcome.error:
            return ()
        item, sample = outcome.item, outcome.item.sample
        words, predicted, status = read_answer(outcome, STEPS)
        own = _errors(standing(STEPS) if predicted is None else predicted, sample.future)
        if status == "no answer":
            own = None, None
        model = InstructedRow(
            item=item.id,
            scene=sample.scene,
            kind=sample.kind if item.instruction else HISTORY_ONLY,
            method=MODEL,
            instruction=item.instruction,
            setting=self._setting,
            shown=self._shown,
            status=status,
            detail=outcome.error,
            ade_m=own[0],
            fde_m=own[1],
            status_without=None,
            ade_without_m=None,
            fde_without_m=None,
            kept=None,
            kept_without=None,
            answer=words,
        )
        found = [model]
        for name, predict in _WORDLESS.items() if item.instruction else ():
            ade, fde = _errors(predict(sample.history, STEPS), sample.future)
            wordless = replace(model, method=name, status="answered", detail="", ade_m=ade, fde_m=fde, answer="")
            found.append(replace(wordless, status_without="answered", ade_without_m=ade, fde_without_m=fde))
        return found

    def together(self, rows: Sequence[Row]) -> Sequence[Row]:
        """The model's errors without an instruction beside those with one, and which scenes are kept (Q97.5)."""
        without = {row["scene"]: row for row in rows if row["kind"] == HISTORY_ONLY}
        found = [
            row | {"status_without": base["status"], "ade_without_m": base["ade_m"], "fde_without_m": base["fde_m"]}
            if row["method"] == MODEL and row["kind"] != HISTORY_ONLY and (base := without.get(row["scene"]))
            else row
            for row in rows
        ]
        compared = [row for row in found if _compared(row)]
        kept = {
            (method, column): _lowest([row for row in compared if row["method"] == method], column)
            for method in _METHODS
            for column in ("ade_m", "ade_without_m")
        }
        return [
            row
            | {
                "kept": row["scene"] in kept[row["method"], "ade_m"],
                "kept_without": row["scene"] in kept[row["method"], "ade_without_m"],
            }
            if _compared(row)
            else row
            for row in found
        ]


def _lowest(rows: Sequence[Row], column: str) -> frozenset[str]:
    """The scenes below the 97.5 % quantile of a method's errors, each scene's the mean over its instructions."""
    errors: dict[str, list[float]] = defaultdict(list)
    for row in rows:
        errors[row["scene"]].append(row[column])
    means = {scene: float(np.mean(values)) for scene, values in errors.items()}
    limit = float(np.quantile(list(means.values()), KEPT)) if means else 0.0
    return frozenset(scene for scene, value in means.items() if value <= limit)


def _errors(predicted: FloatArray, truth: FloatArray) -> tuple[float | None, float | None]:
    """ADE and FDE of waypoints (STEPS, 2), m."""
    away = distances(predicted, truth)
    return round(float(away.mean()), 4), round(float(away[-1]), 4)


def openloop(data: str, instructions: str = "", **options: Any) -> OpenLoopBenchmark:
    """Make the benchmark over 3 s, or with instructions the one over 6 s.

    Args:
        data: Folder with nuScenes' tables and `samples`.
        instructions: doScenes' annotations (folder or file): 6 s ahead, with each instruction and without.
        options: The others of OpenLoopBenchmark.

    Raises:
        ConfigError: An option makes no sense.
        DataError: Files cannot be read, or hold no frame that can be asked about.
    """
    return InstructedBenchmark(data, instructions, **options) if instructions else OpenLoopBenchmark(data, **options)
