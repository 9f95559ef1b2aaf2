# pyright: reportMissingImports=false, reportUnknownParameterType=false
"""The frames models as models that are asked: `vilad-frames/FOLDER` and others in `chauffeur bench openloop`.

They read the conversation that every model gets: the picture, and own motion and command out of the text.
"""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, cast

from chauffeur.concept import ConfigError, PlannerError, Usage
from chauffeur.models.vilad.frames_data import fitted
from chauffeur.planners.base import Prose
from chauffeur.planners.picture_parts import parts_of
from chauffeur.planners.prompts.waypoints import read_motion, waypoints_text

if TYPE_CHECKING:
    from chauffeur.models.vilad.frames_store import FramesMethod
    from chauffeur.planners.prompts import Message


class FramesAnswerer:
    """Answers with waypoints; it writes nothing else.

    `vilad-frames/FOLDER` asks the diffusion model, `vilad-frames` the one that ships; with `,twin`, `,regression` or
    `,status` behind the folder its autoregressive twin, the encoder's own head, or the MLP that sees no picture.
    """

    def __init__(self, folder: Path | None, method: FramesMethod = "vilad") -> None:
        """Args: folder of a trained model, None for what ships; which part of it. Raises DataError: there is none."""
        from chauffeur.models.vilad.frames_store import OWN, load_frames_model

        self._folder = folder
        self._method: FramesMethod = method
        self._model = load_frames_model(folder or OWN)

    @classmethod
    def from_spec(cls, argument: str) -> Self:
        """Model for `vilad-frames`, `vilad-frames/FOLDER` or `vilad-frames/FOLDER,PART`.

        Raises:
            ConfigError: There is no such part.
            DataError: The folder holds no model.
        """
        from chauffeur.models.vilad.frames_store import METHODS

        folder, _, method = argument.partition(",")
        found = next((one for one in METHODS if one == (method or "vilad")), None)
        if found is None:
            raise ConfigError(f"A frames model has no part {method!r}.", hint=f"Choose of: {', '.join(METHODS)}.")
        return cls(Path(folder) if folder else None, found)

    @property
    def id(self) -> str:
        """`vilad-frames/FOLDER,PART`; no folder of the one that ships."""
        return f"vilad-frames/{self._folder or ''},{self._method}"

    @property
    def model(self) -> str:
        """Name of the model."""
        return f"{self._model.about['version']}, {self._method}"

    async def write(self, messages: Sequence[Message]) -> Prose:
        """Six waypoints. Raises PlannerError: picture, own motion or command cannot be read."""
        pictures, text = parts_of(cast("Mapping[str, Any]", messages[-1]))
        if not pictures and self._method != "status":
            raise PlannerError("The conversation's last turn has no picture.", hint="Ask with setting sft.")
        try:
            history, command = read_motion(text)
        except ValueError as error:
            raise PlannerError(f"The question tells no motion that can be read: {error}.") from error
        image = pictures[-1].image if pictures else None
        return await asyncio.to_thread(self._answer, image, history, command)

    def _answer(self, image: Any, history: Any, command: str) -> Prose:
        import numpy as np

        size = self._model.size
        picture = np.zeros((*size, 3), np.uint8) if image is None else fitted(image, size)
        waypoints, _ = self._model.waypoints(self._method, history, command, picture)
        return Prose(waypoints_text(waypoints), whole=True, model=self.model, usage=Usage())
