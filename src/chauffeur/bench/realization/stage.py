"""A scene for a labelled command: a street of a town with what the command names, and a distractor beside it.

The distractor is of the same kind in another colour where the command names a colour, so that the colour decides; else
of another kind, so that nobody has to guess. A command about what a town cannot stage (a gate, a lot) has no scene.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from chauffeur.concept import Scenario
from chauffeur.concept.utterance import Act, Colour, Reference, ReferenceKind
from chauffeur.worlds.town.staged import StagedActor, StagedKind

TOWN: Final = "Gridford"
LEFT_LANE, RIGHT_LANE = ("4:0:-1", 6.0), ("4:0:-2", 6.0)
"""A street of two lanes each way, 60 m before a junction with lights; left turns from the one, right from the other."""
SEED: Final = 1
_ROLLING_MPS: Final = 10.0
"""Of a car that is to change its speed: from a stand whatever it does is slower than that."""
_KERB_M: Final = -2.8
_KERB_PLACES_M: Final = (44.0, 30.0, 20.0)
_AFTER_TURN_M: Final = (112.0, 96.0)
_VERBS: Final = frozenset(
    {"follow", "pass", "avoid", "yield", "stop", "park", "pull_over", "wait", "go", "turn", "straight", "lane", "speed"}
)
_KINDS: Final[dict[ReferenceKind, StagedKind]] = {
    "car": "car", "truck": "truck", "bus": "bus", "van": "van", "motorcycle": "motorcycle", "bicycle": "bicycle",
    "pedestrian": "pedestrian", "pedestrians": "pedestrian", "vehicle": "car", "vehicles": "car", "traffic": "car",
    "obstacle": "obstacle", "cone": "static", "barrier": "obstacle",
}  # fmt: skip
_NEEDS_NOTHING: Final[frozenset[ReferenceKind]] = frozenset({"junction", "light", "me_here", "road", "lane"})
_OTHER: Final[dict[StagedKind, StagedKind]] = {"car": "truck", "truck": "car", "bus": "car", "van": "truck"}
_COLOURS: Final[tuple[Colour, ...]] = ("red", "blue", "white", "black")
_EVENTS: Final = frozenset({"gone", "passed", "moves", "green", "clear"})


@dataclass(slots=True)
class CommandScene:
    """Where a command is said.

    Attributes:
        start: Lane and station at which the ego begins.
        speed_mps: Of the ego there.
        actors: The stage.
        referents: Which of them each reference means, by place on the stage.
    """

    start: tuple[str, float]
    speed_mps: float = 0.0
    actors: list[StagedActor] = field(default_factory=list[StagedActor])
    referents: dict[Reference, tuple[int, ...]] = field(default_factory=dict[Reference, tuple[int, ...]])

    def scenario(self, name: str) -> Scenario:
        """As a world takes it."""
        config: dict[str, Any] = {
            "town": TOWN, "start": list(self.start), "vehicles": 0, "people": 0, "ego_speed": self.speed_mps,
            "stage": [one.model_dump(mode="json", exclude_defaults=True) for one in self.actors],
        }  # fmt: skip
        return Scenario(f"realization-{name}", "town", config, SEED)


class _UnstagedError(Exception):
    """The command names what a town cannot stage."""


def stage_of(acts: Sequence[Act]) -> CommandScene | None:
    """The scene of a labelled command; None where a town cannot stage it."""
    wanted = [act for act in acts if not act.purpose]
    if not wanted or any(act.act not in _VERBS for act in wanted):
        return None
    turns = [act for act in wanted if act.act in ("turn", "straight") and not act.negated]
    first = turns[0].side if turns and turns[0].act == "turn" else None
    lanes = [act.side for act in wanted if act.act == "lane"]
    left = lanes[0] == "right" if lanes else first == "left"
    scene = CommandScene(LEFT_LANE if left else RIGHT_LANE, _ROLLING_MPS if wanted[0].act == "speed" else 0.0)
    side: tuple[Any, ...] = ()
    try:
        for act in wanted:
            if (act.act in ("lane", "turn") and act.side is None) or (act.act == "lane" and side):
                return None
            for reference, role in _roles(act):
                _put(scene, reference, role, act, side)
            if act.act == "turn" and not act.negated:
                if side:
                    return None
                side = (act.side,)
    except _UnstagedError:
        return None
    return scene


def _roles(act: Act) -> list[tuple[Reference, str]]:
    """References of an act, with the part that each plays."""
    found: list[tuple[Reference, str]] = []
    if act.target is not None:
        found.append((act.target, act.act))
    if act.place is not None and act.place.ref is not None:
        found.append((act.place.ref, "place"))
    if act.when is not None:
        if act.when.event not in _EVENTS or act.when.type in ("unless", "before", "if"):
            raise _UnstagedError
        if act.when.ref is not None:
            found.append((act.when.ref, act.when.event))
    return found


def _put(scene: CommandScene, reference: Reference, role: str, act: Act, way: tuple[Any, ...]) -> None:
    if reference in scene.referents or reference.kind in _NEEDS_NOTHING:
        return
    kind = _KINDS.get(reference.kind)
    if kind is None or reference.of is not None or reference.ordinal not in (None, 1) or reference.where == "behind":
        raise _UnstagedError
    actor = _actor(scene, reference, kind, role, act, way)
    scene.referents[reference] = (len(scene.actors),)
    scene.actors.append(actor)
    _distract(scene, reference, actor, role)


def _actor(
    scene: CommandScene, reference: Reference, kind: StagedKind, role: str, act: Act, way: tuple[Any, ...]
) -> StagedActor:
    thing = kind in ("static", "obstacle")
    if thing and (reference.colour is not None or role == "gone"):
        raise _UnstagedError
    colour: Colour | None = "black" if reference.colour == "dark" else reference.colour
    crosses = role in ("yield", "gone", "clear")
    if kind == "pedestrian" and crosses and not way:
        left = reference.side == "left"
        return StagedActor(
            kind=kind, colour=colour, ahead_m=57.0, left_m=7.2 if left else -3.6, heading="right" if left else "left",
            speed_mps=1.3, for_m=12.0, near_m=36.0,
        )  # fmt: skip
    moves = role in ("gone", "yield", "clear") or reference.state in ("oncoming", "moving", "turning", "crossing")
    if reference.state == "turning" or (moves and reference.side == "right" and act.act != "lane"):
        raise _UnstagedError
    if role == "follow" and kind not in ("pedestrian", "static", "obstacle"):
        turns = way or (("left",) if scene.start == LEFT_LANE else ("right",))  # where it goes decides, not the road
        return StagedActor(kind=kind, colour=colour, ahead_m=18.0, drives=True, turns=turns)
    if role == "moves" and not way and kind != "pedestrian":
        return StagedActor(kind=kind, colour=colour, ahead_m=16.0, speed_mps=7.0, after_s=6.0, for_m=200.0)
    if moves and kind not in ("pedestrian", "static", "obstacle") and not way:
        if act.act == "lane":  # comes by in the lane that is changed into
            aside = 3.5 if act.side == "left" else -3.5
            return StagedActor(kind=kind, colour=colour, ahead_m=-4.0, left_m=aside, drives=True, speed_mps=9.0)
        return StagedActor(kind=kind, colour=colour, ahead_m=45.0, left_m=7.0, heading="against", speed_mps=7.0)
    walks = kind == "pedestrian" and reference.state in ("walking", "moving")
    if reference.state not in (None, "parked", "stopped", "standing") and not walks:
        raise _UnstagedError
    if not way and (scene.start == LEFT_LANE or reference.side == "left"):
        raise _UnstagedError  # no kerb beside that lane
    places = _AFTER_TURN_M if way else _KERB_PLACES_M
    used = sum(one.left_m in (_KERB_M, -3.6, -2.4) and bool(one.way) == bool(way) for one in scene.actors)
    if used >= len(places):
        raise _UnstagedError
    aside = {"pedestrian": -3.6, "static": -2.4, "obstacle": -3.0}.get(kind, _KERB_M)
    at = 20.0 if reference.where == "near" and not way else places[used]
    pace = 0.7 if walks else 0.0
    return StagedActor(kind=kind, colour=colour, ahead_m=at, left_m=aside, way=way, speed_mps=pace, for_m=12.0)


def _distract(scene: CommandScene, reference: Reference, actor: StagedActor, role: str) -> None:
    """Put a distractor at the kerb, nearer than what is meant."""
    if scene.start == LEFT_LANE and not actor.way:
        return
    plural = reference.kind in ("vehicles", "traffic", "pedestrians", "vehicle", "obstacle", "cone", "barrier")
    if plural or role in ("gone", "yield", "clear"):
        return
    if reference.colour is not None and reference.kind != "van":
        kind: StagedKind = actor.kind
        colour: Colour | None = next(one for one in _COLOURS if one != actor.colour)
    else:
        kind, colour = _OTHER.get(actor.kind, "car"), None
    aside = -3.6 if kind == "pedestrian" else _KERB_M
    at = 88.0 if actor.way else 24.0 if actor.ahead_m > 36.0 else 50.0
    scene.actors.append(StagedActor(kind=kind, colour=colour, ahead_m=at, left_m=aside, way=actor.way))
