# pyright: reportMissingImports=false, reportUnknownParameterType=false
"""Evaluation of a VLM's seeing, listening and gains: on places, writers and looks that training did not have."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import fmean, median

from chauffeur.bench.motion.items import style_ranges
from chauffeur.bench.motion.scoring import command_alignment
from chauffeur.models.vlm.scenes import PictureSet
from chauffeur.planners.vlm.engine import VlmEngine
from chauffeur.planners.vlm.template import SEEN_WEATHERS
from chauffeur.safety.gain_box import care


@dataclass(frozen=True, slots=True)
class VlmFigures:
    """Shares in percent, over pictures paired with wishes.

    Attributes:
        count: Pairs.
        weather, grade, lead, road: Seen as they are.
        style: Heard as it was meant.
        command_alignment: Eq. 27, mean, points.
        scenario_alignment: Pairs of the same wish, of a picture of adverse weather and the sunny one before it, whose
            gains are the more conservative in adverse weather.
        latency_ms: Median of a whole reading.
    """

    count: int
    weather: float
    grade: float
    lead: float
    road: float
    style: float
    command_alignment: float
    scenario_alignment: float
    latency_ms: float


def vlm_figures(
    engine: VlmEngine, pictures: PictureSet, wishes: Sequence[tuple[str, str]], *, blind: bool = False
) -> VlmFigures:
    """Read each picture with a wish; five pictures in a row, one a weather, get the same one.

    Args:
        engine: The model.
        pictures: With what is true of them; their weathers take turns.
        wishes: (wish, style), as many as there are rows of five.
        blind: Whether to show black pictures.
    """
    right: dict[str, list[bool]] = {name: [] for name in ("weather", "grade", "lead", "road", "style")}
    aligned: list[float] = []
    more: list[bool] = []
    seconds: list[float] = []
    for start in range(0, len(pictures) - len(SEEN_WEATHERS) + 1, len(SEEN_WEATHERS)):
        wish, style = wishes[start // len(SEEN_WEATHERS) % len(wishes)]
        cares: dict[str, float] = {}
        for place in range(start, start + len(SEEN_WEATHERS)):
            facts = pictures.facts[place]
            begun = time.perf_counter()
            task = pictures.facts[start].task
            read = engine.read(wish, None if blind else pictures.pixels[place], {"task": task, "recall": "none"})
            seconds.append(time.perf_counter() - begun)
            for name in ("weather", "grade", "lead", "road"):
                right[name].append(read.values[name] == getattr(facts, name))
            right["style"].append(read.values["style"] == style)
            aligned.append(command_alignment(read.policy, style_ranges()[style]))
            cares[facts.weather] = care(read.policy)
        more += [value > cares["sunny"] + 1e-6 for weather, value in cares.items() if weather != "sunny"]
    seen = {name: 100.0 * fmean(hits) for name, hits in right.items()}
    return VlmFigures(
        count=len(aligned),
        weather=seen["weather"],
        grade=seen["grade"],
        lead=seen["lead"],
        road=seen["road"],
        style=seen["style"],
        command_alignment=fmean(aligned),
        scenario_alignment=100.0 * fmean(more),
        latency_ms=1000.0 * median(seconds),
    )
