"""A model that is asked where the car will be, as a planner: its waypoints of the next three seconds are the policy.

`waypoints/<model>` asks any model that answers questions, such as `waypoints/openai/<vlm>` or `waypoints/vilad-frames`,
in the words of the open-loop benchmark. It sees the front camera; its answer is checked and tracked as any trajectory.
"""

from __future__ import annotations

import io
import time
from typing import TYPE_CHECKING, Final

import numpy as np

from chauffeur.concept import Plan, PlanRequest, Trajectory
from chauffeur.foreign.model_text import read_model_text
from chauffeur.foreign.waypoints import FUTURE, STEP_S, read_waypoints
from chauffeur.planners.base import Answerer, declined, planned
from chauffeur.planners.llm_reply import tidy
from chauffeur.planners.prompts.waypoints import HISTORY, ROLE, ask, asked_of, motion_words, tells_motion, with_wish
from chauffeur.planners.registry import make_answerer

if TYPE_CHECKING:
    from chauffeur.concept import CameraImage
    from chauffeur.planners.prompts import Message

SIDE_PX: Final = 448
"""Longer side of the picture as it is sent: that of the open-loop benchmark."""
_UNREAD: Final = "The model gave no waypoints that can be read."
_DRIVEN: Final = "I drive what the model answered:"


class WaypointPlanner:
    """Asks a model for the next waypoints of the car; it has to be asked again before they end."""

    sees = True
    """Pictures are taken for it."""

    def __init__(self, model: Answerer) -> None:
        """Args: who is asked."""
        self._model = model

    @classmethod
    def from_spec(cls, argument: str, *, base_url: str | None = None) -> WaypointPlanner:
        """`waypoints/<model>`.

        Args:
            argument: A model that answers questions, e.g. `openai/gpt-4o` or `vilad-frames`.
            base_url: Of the endpoint of a model behind one.

        Raises:
            ConfigError: There is no such model.
        """
        options = {} if base_url is None else {"base_url": base_url}
        return cls(make_answerer(argument or "vilad-frames", **options))

    @property
    def id(self) -> str:
        """`waypoints/<model>`."""
        return f"waypoints/{self._model.id}"

    @property
    def model(self) -> str:
        """Model with its version."""
        return self._model.model

    async def plan(self, request: PlanRequest) -> Plan:
        """Waypoints as a trajectory of three seconds; declined where the answer has none.

        Raises:
            PlannerError: The model gave no answer.
        """
        begun = time.perf_counter()
        prose = await self._model.write([self._question(request)])
        found = read_waypoints(prose.text) if prose.whole else None
        if found is None:
            return declined(self, _UNREAD, begun, intent="unusable", usage=prose.usage, raw=prose.text)
        points = tuple((float(x), float(y)) for x, y in found)
        return planned(
            self,
            f"{_DRIVEN} {tidy(read_model_text(prose.text).answer)}",
            Trajectory(points, STEP_S),
            begun,
            intent="waypoints",
            usage=prose.usage,
            raw=prose.text,
        )

    def _question(self, request: PlanRequest) -> Message:
        context = request.context.text
        if not tells_motion(context):
            context = f"{context}\n{motion_words(_steady(request.context.situation.speed_mps))}"
        text = f"{ROLE}\n{context}\n{with_wish(ask(FUTURE), request.instruction.text)}"
        return asked_of(_jpeg(request.images[-1]) if request.images else None, text)


def _steady(speed_mps: float) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Motion that is not told: straight, at the present speed."""
    back = -speed_mps * STEP_S * np.arange(HISTORY, -1, -1, dtype=np.float64)
    return np.stack((back, np.zeros_like(back), np.zeros_like(back)), axis=1)


def _jpeg(image: CameraImage) -> bytes:
    from PIL import Image

    picture = Image.fromarray(image.pixels())
    picture.thumbnail((SIDE_PX, SIDE_PX))
    out = io.BytesIO()
    picture.save(out, "JPEG", quality=90)
    return out.getvalue()
