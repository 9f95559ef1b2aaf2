# pyright: reportMissingImports=false, reportUnknownParameterType=false
"""The compact BEV-LLM as the reader of a situation descriptor that looks (`describe.vision`).

What it says of a scene are the likeliest classes that its tokens hold, the same that its answers are made from.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, cast

import numpy as np

from chauffeur.bench.nuplanqa.frames import CAMERAS
from chauffeur.camera import Rig, nuplan_rig
from chauffeur.describe.vision import SceneAnswers
from chauffeur.models.bev_llm.facets import APPROACHES_MPS, DISTANCES_M, KINDS
from chauffeur.models.bev_llm.recipe import WEIGHTS, CompactAnswerer
from chauffeur.models.bev_llm.views import DETAIL, FRONT_VIEWS, VIEWS, camera_of, cut

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Pictures = Mapping[str, NDArray[np.uint8]]

_WAY_M: Final = 4.0
"""Half the width of the strip ahead in which people are told of."""
_SURE: Final = 0.5
"""Probability from which a cell is taken to hold somebody on foot."""


class BevLlmReader:
    """Reads pictures of nuPlan's six cameras."""

    def __init__(self, folder: Path | None = None) -> None:
        """Args: folder of a trained network; None for the shipped one. Raises DataError: there is none."""
        self._answerer = CompactAnswerer.load(folder or WEIGHTS)
        high, wide = self._answerer.network.config.size
        rig = nuplan_rig(2 * wide, 2 * high).only(*CAMERAS)
        front, *others = rig.cameras
        self._rig = replace(rig, cameras=(front.sized(DETAIL * wide, DETAIL * high), *others))

    @property
    def rig(self) -> Rig:
        """See SceneReader: twice the size of a view, the front one four times, as its middle is cut out."""
        return self._rig

    def read(self, now: Pictures, before: Pictures, moved: tuple[float, float, float]) -> SceneAnswers:
        import torch

        size = self._answerer.network.config.size
        present, past = np.zeros((1, len(VIEWS), 3, *size), np.uint8), np.zeros((1, 1, FRONT_VIEWS, 3, *size), np.uint8)
        for out, pictures in ((present[0], now), (past[0, 0], before)):
            for place, view in enumerate(VIEWS[: len(out)]):
                out[place] = cut(_image(pictures[camera_of(view)]), view, size)
        motion = np.zeros((1, 2, 3), np.float32)
        motion[0, -1] = (moved[0] / 10.0, moved[1] / 10.0, moved[2])
        with torch.inference_mode():
            tokens, cells = self._answerer.tokens(present, past, motion)
            logits = self._answerer.network.classes(tokens)
            chosen = {
                name: classes[int(scores[0].argmax())]
                for (name, classes), scores in zip(self._answerer.facets, logits, strict=True)
            }
            likely = {
                name: scores[0].softmax(dim=0).numpy()
                for (name, _), scores in zip(self._answerer.facets, logits, strict=True)
            }
            people = () if cells is None else self._people(self._answerer.network.occupied(cells)[0].softmax(dim=1))
        light = chosen["light"]
        return SceneAnswers(
            ahead=_who(chosen["ahead"]),
            ahead_m=_median(likely["distance"][1:], (6.0, *DISTANCES_M, 100.0)),
            ahead_faster_mps=_median(likely["approach"], (-9.0, *APPROACHES_MPS, 9.0)),
            left=_who(chosen["beside left"]),
            right=_who(chosen["beside right"]),
            behind=_who(chosen["behind"]),
            light=None if light == "none" else cast("Any", light),
            sky=chosen["sky"],
            people_ahead_m=people,
        )

    def _people(self, likely: Any) -> tuple[float, ...]:
        """How far ahead of the ego's centre cells are that hold somebody on foot, m."""
        places = self._answerer.network.config.fusion.grid.centres()
        on_foot = likely[:, KINDS.index("pedestrian")].numpy() > _SURE
        way = on_foot & (np.abs(places[:, 1]) < _WAY_M) & (places[:, 0] > 0.0)
        return tuple(float(x) + self._rig.origin_ahead_m for x in sorted(places[way, 0]))


def _who(name: str) -> Any:
    return None if name == "nobody" else name


def _median(likely: NDArray[np.float32], bounds: tuple[float, ...]) -> float:
    """Where half of the probability is reached, linear within a class; `bounds` are one more than the classes."""
    reached = np.concatenate([[0.0], np.cumsum(likely / likely.sum())])
    place = min(bisect_right(reached.tolist(), 0.5) - 1, len(likely) - 1)
    share = (0.5 - reached[place]) / max(1e-6, reached[place + 1] - reached[place])
    return float(bounds[place] + share * (bounds[place + 1] - bounds[place]))


def _image(pixels: NDArray[np.uint8]) -> Any:
    from PIL import Image

    return Image.fromarray(pixels)
