# pyright: reportMissingImports=false, reportUnknownParameterType=false
"""The compact BEV-LLM as a model that is asked: `bev-llm` in `chauffeur bench nuplanqa`, or `bev-llm/FOLDER`."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from chauffeur.bench.nuplanqa.questions import LETTERS, read_question
from chauffeur.concept import PlannerError, Usage
from chauffeur.models.bev_llm.views import FRONT_VIEWS, VIEWS, camera_of, cut
from chauffeur.planners.base import Prose
from chauffeur.planners.picture_parts import ShownPicture, parts_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from chauffeur.planners.prompts import Message


class BevLlmAnswerer:
    """Answers questions of NuPlanQA's format with a letter; it writes nothing else."""

    def __init__(self, folder: Path | None = None) -> None:
        """Args: folder of a trained network; None for the shipped one. Raises DataError: there is none."""
        from chauffeur.models.bev_llm.recipe import WEIGHTS, CompactAnswerer

        self._name = "shipped" if folder is None else str(folder)
        self._answerer = CompactAnswerer.load(folder or WEIGHTS)

    @classmethod
    def from_spec(cls, argument: str) -> BevLlmAnswerer:
        """Model for `bev-llm/FOLDER`; for `bev-llm` alone the shipped one."""
        return cls(Path(argument) if argument else None)

    @property
    def id(self) -> str:
        """`bev-llm/FOLDER`."""
        return f"bev-llm/{self._name}"

    @property
    def model(self) -> str:
        """Name of the model, with the inputs it keeps."""
        return f"bev-llm-compact, {self._answerer.keep}"

    async def write(self, messages: Sequence[Message]) -> Prose:
        """The letter of the option it takes for right. Raises PlannerError: question or picture cannot be read."""
        pictures, text = parts_of(cast("Mapping[str, Any]", messages[-1]))
        letter = await asyncio.to_thread(self._choose, pictures, text)
        return Prose(f"({letter})", whole=True, model=self.model, usage=Usage())

    def _choose(self, pictures: Sequence[ShownPicture], text: str) -> str:
        try:
            read = read_question(text.partition("\n\nAnswer with")[0])
        except ValueError as error:
            raise PlannerError(f"The question is not of NuPlanQA's format: {error}.") from error
        now, past, ago_s = self._views(pictures)
        motion = np.zeros((1, 1 + past.shape[1], 3), np.float32)
        if ago_s:  # the published format tells speeds alone: straight on for as long
            motion[0, -1, 0] = float(np.mean(read.speeds_mps or (0.0,))) * ago_s / 10.0
        import torch

        with torch.inference_mode():
            tokens, _ = self._answerer.tokens(now, past, motion)
            asked = [(0, read.question, read.options, read.speeds_mps)]
            return LETTERS[int(self._answerer.scores(tokens, asked).argmax())]

    def _views(self, pictures: Sequence[ShownPicture]) -> tuple[NDArray[np.uint8], NDArray[np.uint8], float]:
        """Views of the present instant, (1, V, 3, H, W), those of the earliest one shown, (1, 0 or 1, P, 3, H, W), and
        how long ago that was, s. Grey where no picture was shown."""
        size = self._answerer.network.config.size
        shown = {_labelled(one.caption): one.image for one in pictures}
        earliest = max((ago for _, ago in shown), default=0.0)
        now = np.full((1, len(VIEWS), 3, *size), 128, np.uint8)
        past = np.full((1, 1 if earliest else 0, FRONT_VIEWS, 3, *size), 128, np.uint8)
        for out, ago in ((now[0], 0.0), *((one, earliest) for one in past[0])):
            for place, view in enumerate(VIEWS[: len(out)]):
                image = shown.get((camera_of(view), ago))
                if image is not None:
                    out[place] = cut(image, view, size)
        return now, past, earliest


def _labelled(caption: str) -> tuple[str, float]:
    """Camera and how long ago, from a caption such as `CAM_F0 (front), 0.5 s ago:`."""
    name, _, when = caption.rstrip(":").partition(",")
    words = when.split()
    ago = float(words[0]) if len(words) > 1 and words[1] == "s" else 0.0
    return name.split(" ")[0], ago
