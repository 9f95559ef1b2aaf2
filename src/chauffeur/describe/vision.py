"""C from cameras: road users, lights and weather as a model sees them in pictures, in place of the world's own state.

The car's own instruments and map stay: its speed, its lane, limits, the route, stop signs. Everybody else is taken out
of the observation, and who the model has seen is put in; the descriptors then say of it what they say of any
observation. Checks and the safety filter keep the world's own state: this is what a planner is told, no more.

A simulated trip begins with the wish, so the picture of a moment before is taken of the scene moved back at constant
speeds.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, Protocol

from chauffeur.camera import Conditions, Rig
from chauffeur.concept import Context, Lead, Observation, VehicleState
from chauffeur.concept.scene import AgentKind, SignalState
from chauffeur.describe.road import ego_lane, own_direction
from chauffeur.describe.town import own_signals
from chauffeur.describe.traffic import describe_with_traffic

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from chauffeur.camera import Renderer
    from chauffeur.geometry import Lane

    Pictures = Mapping[str, NDArray[np.uint8]]

AGO_S: Final = 2.0
"""How long before the present the other picture was taken."""
_SIZES: Final[Mapping[str, tuple[float, float]]] = {
    "car": (5.0, 2.0),
    "truck": (9.0, 2.5),
    "bus": (12.0, 2.55),
    "motorcycle": (2.2, 0.8),
    "bicycle": (1.8, 0.6),
    "pedestrian": (0.5, 0.6),
}
_CLEAR: Final = Conditions()
_BESIDE_M: Final = 3.0
_BEHIND_M: Final = -16.0
"""Where a vehicle beside and one behind are taken to be: a picture's answer names a range, not a place."""


@dataclass(frozen=True, slots=True)
class SceneAnswers:
    """What a model has seen in the pictures of an instant.

    Attributes:
        ahead: Next road user in the ego's lane; None for nobody.
        ahead_m: How far ahead it is, centre to centre.
        ahead_faster_mps: How much faster than the ego it drives; negative where the gap closes.
        left, right: Vehicle beside the ego or just ahead, in the lane on either side; None for nobody.
        behind: Vehicle behind in the ego's lane; None for nobody.
        light: What the ego's traffic light shows; None for no light.
        sky: Weather and light, in words.
        people_ahead_m: How far ahead somebody is on foot on or near the ego's way, m.
    """

    ahead: AgentKind | None = None
    ahead_m: float = 0.0
    ahead_faster_mps: float = 0.0
    left: AgentKind | None = None
    right: AgentKind | None = None
    behind: AgentKind | None = None
    light: SignalState | None = None
    sky: str = ""
    people_ahead_m: tuple[float, ...] = ()


class SceneReader(Protocol):
    """A model that answers from pictures what is around the ego; it lives above this floor and is handed in."""

    @property
    def rig(self) -> Rig:
        """The cameras it looks through, with the size of their pictures."""
        ...

    def read(self, now: Pictures, before: Pictures, moved: tuple[float, float, float]) -> SceneAnswers:
        """What it sees.

        Args:
            now: Pictures (H, W, 3) by camera.
            before: The same, AGO_S earlier.
            moved: How the ego has moved since: forward and leftward, m, and turned, rad.
        """
        ...


@dataclass(frozen=True)
class CameraDescriptor:
    """Situation descriptor that looks: an observation is rendered, read by the model, and described as it saw it.

    Attributes:
        reader: The model.
        renderer: Takes the pictures.
        conditions: Weather and light they are taken in.
        place: Seed of what stands along the road.
        told: Is given each instant's answers.
    """

    reader: SceneReader
    renderer: Renderer
    conditions: Conditions = _CLEAR
    place: int = 0
    told: Callable[[SceneAnswers], None] = lambda _: None

    def __call__(self, observation: Observation) -> Context:
        """C. Raises ScenarioError: as `describe`; or the observation has no road to render."""
        answers = self.look(observation)
        self.told(answers)
        return describe_seen(observation, answers)

    def look(self, observation: Observation) -> SceneAnswers:
        """What the model sees of an observation."""
        before = rewound(observation, AGO_S)
        now, past = (self._pictures(instant) for instant in (observation, before))
        return self.reader.read(now, past, (observation.ego.speed_mps * AGO_S, 0.0, 0.0))

    def _pictures(self, observation: Observation) -> Pictures:
        taken = self.renderer.render(observation, self.reader.rig, self.conditions, self.place)
        return {image.camera: image.pixels() for image in taken.images}


def rewound(observation: Observation, seconds: float) -> Observation:
    """The scene some time ago, if everybody has kept speed and heading."""

    def moved(one: VehicleState) -> VehicleState:
        way = one.speed_mps * seconds
        return replace(
            one, x_m=one.x_m - way * math.cos(one.heading_rad), y_m=one.y_m - way * math.sin(one.heading_rad)
        )

    return replace(
        observation,
        time_s=observation.time_s - seconds,
        ego=moved(observation.ego),
        others=tuple(map(moved, observation.others)),
    )


def describe_seen(observation: Observation, answers: SceneAnswers) -> Context:
    """C of an observation whose others are those that were seen. Raises ScenarioError: as `describe`."""
    context = describe_with_traffic(seen(observation, answers))
    if not answers.sky:
        return context
    weather = (*context.situation.scene, ("weather", f"It is a {answers.sky}, by the cameras."))
    return replace(context, situation=replace(context.situation, scene=weather))


def seen(observation: Observation, answers: SceneAnswers) -> Observation:
    """An observation with who was seen in place of who is there. Raises ScenarioError: the ego is on no lane."""
    ego, lane, lanes = observation.ego, ego_lane(observation), own_direction(observation)
    place = lanes.index(lane)
    found: list[VehicleState] = []

    def add(kind: AgentKind, along: Lane, ahead_m: float, speed_mps: float) -> VehicleState:
        pose = along.centre.at(along.centre.project(ego.x_m, ego.y_m)[0])
        c, s = math.cos(pose.heading_rad), math.sin(pose.heading_rad)
        length, width = _SIZES[kind]
        one = VehicleState(
            id=len(found) + 1,
            kind=kind,
            x_m=pose.x_m + ahead_m * c,
            y_m=pose.y_m + ahead_m * s,
            heading_rad=pose.heading_rad,
            speed_mps=max(0.0, speed_mps),
            length_m=length,
            width_m=width,
            lane=along.id,
        )
        found.append(one)
        return one

    front: Lead | None = None
    if answers.ahead is not None:
        lead = add(answers.ahead, lane, answers.ahead_m, ego.speed_mps + answers.ahead_faster_mps)
        front = Lead(lead.id, answers.ahead_m, lead.speed_mps)
    if answers.behind is not None:
        add(answers.behind, lane, _BEHIND_M, ego.speed_mps)
    beside: tuple[tuple[int, AgentKind | None], ...] = ((-1, answers.left), (1, answers.right))
    for side, kind in beside:
        if kind is not None and 0 <= place + side < len(lanes):
            add(kind, lanes[place + side], _BESIDE_M, ego.speed_mps)
    for ahead_m in answers.people_ahead_m:
        add("pedestrian", lane, ahead_m, 0.0)
    light = answers.light
    signals = () if light is None else tuple(replace(one, state=light) for one in own_signals(observation))
    return replace(observation, others=tuple(found), front=front, signals=signals)
