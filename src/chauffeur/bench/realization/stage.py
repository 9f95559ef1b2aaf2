"""A scene for a labelled command: a street of a town with what the command names, and a distractor beside it.

The distractor is of the same kind in another colour where the command names a colour, so that the colour decides;
else of another kind, so that nobody has to guess; of an ordinal it is another of the same. A command about what a town
cannot stage (a gate, a lot) has no scene.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from chauffeur.concept import Scenario
from chauffeur.concept.utterance import Act, Colour, Reference, ReferenceKind, Side
from chauffeur.geometry import Turn
from chauffeur.language.ground import spoken_of
from chauffeur.worlds.town.staged import StagedActor, StagedKind

TOWN: Final = "Gridford"
Start = tuple[str, float]
LEFT_LANE, RIGHT_LANE = ("4:0:-1", 6.0), ("4:0:-2", 6.0)
"""A street of two lanes each way, 60 m before a junction with lights; left turns from the one, right from the other."""
SIDE_STREETS: Final[dict[Side, Start]] = {"left": ("11:0:-1", 6.0), "right": ("15:0:1", 6.0)}
"""Streets of one lane each way that meet that one at the same lights; such a turn leads into a long block of it."""
ENDS: Final[dict[Side, Start]] = {"left": ("5:0:-1", 6.0), "right": ("5:0:-2", 6.0)}
"""The lanes in which that street ends, where one turns to that side only."""
FAR: Final[dict[Side, Start]] = {"left": ("3:0:-1", 6.0), "right": ("3:0:-2", 6.0)}
"""The lanes of that street a block before, for who counts junctions."""
SEED: Final = 1
_ROLLING_MPS: Final = 10.0
"""Of a car that is to change its speed or its gap: from a stand whatever it does is slower than that."""
_LANE_M: Final = 3.5
_KERB_M: Final = -2.8
_OVER_THE_STREET_M: Final = 6.4
"""The other side of a street of one lane each way."""
_KERB_PLACES_M: Final = (44.0, 30.0, 20.0)
_ROW_M: Final = (22.0, 34.0, 46.0)
"""Where several alike stand, one of which an ordinal names."""
_AFTER_TURN_M: Final = (124.0, 108.0)
"""Far enough behind the junction that a distractor leaves room to come out of it."""
_LEFT_TURN_M: Final = 10.0
"""Extra length of the way over a junction to the left."""
_SECOND_TURN_M: Final = 98.0
"""Extra distance behind a second turn."""
_VERBS: Final = frozenset(
    {
        "follow", "pass", "avoid", "yield", "stop", "park", "pull_over", "wait", "go", "turn", "straight", "lane",
        "keep", "speed", "gap",
    }
)  # fmt: skip
_KINDS: Final[dict[ReferenceKind, StagedKind]] = {
    "car": "car", "truck": "truck", "bus": "bus", "van": "van", "motorcycle": "motorcycle", "bicycle": "bicycle",
    "pedestrian": "pedestrian", "pedestrians": "pedestrian", "vehicle": "car", "vehicles": "car", "traffic": "car",
    "obstacle": "obstacle", "cone": "static", "barrier": "obstacle",
}  # fmt: skip
_NEEDS_NOTHING: Final[frozenset[ReferenceKind]] = frozenset(
    {"junction", "light", "me_here", "road", "lane", "crosswalk", "end_of_road"}
)
_COUNTED: Final[frozenset[ReferenceKind]] = frozenset({"junction", "light", "road"})
_MOST_COUNTED: Final = 3
_ANYWHERE: Final[frozenset[ReferenceKind]] = frozenset({"road", "lane", "sidewalk", "other"})
"""What something may stand on or by without being staged."""
_OTHER: Final[dict[StagedKind, StagedKind]] = {"car": "truck", "truck": "car", "bus": "car", "van": "truck"}
_COLOURS: Final[tuple[Colour, ...]] = ("red", "blue", "white", "black")
_EVENTS: Final = frozenset({"gone", "passed", "moves", "green", "clear", "near", "time"})
_UNMOVING: Final[frozenset[StagedKind]] = frozenset({"static", "obstacle"})


@dataclass(slots=True)
class CommandScene:
    """Scene in which a command is said.

    Attributes:
        start: Lane and station at which the ego begins.
        speed_mps: Of the ego there.
        actors: The stage.
        referents: Which of them each reference means, by place on the stage.
        named: All that the command names.
    """

    start: Start
    speed_mps: float = 0.0
    actors: list[StagedActor] = field(default_factory=list[StagedActor])
    referents: dict[Reference, tuple[int, ...]] = field(default_factory=dict[Reference, tuple[int, ...]])
    named: tuple[Reference, ...] = ()

    def scenario(self, name: str) -> Scenario:
        """As a world takes it."""
        config: dict[str, Any] = {
            "town": TOWN, "start": list(self.start), "vehicles": 0, "people": 0, "ego_speed": self.speed_mps,
            "stage": [one.model_dump(mode="json", exclude_defaults=True) for one in self.actors],
        }  # fmt: skip
        return Scenario(f"realization-{name}", "town", config, SEED)

    @property
    def side_street(self) -> bool:
        """True if it begins on a street of one lane each way."""
        return self.start in SIDE_STREETS.values()

    @property
    def has_kerb(self) -> bool:
        """True if there is a kerb beside the lane in which it begins."""
        return self.start not in (LEFT_LANE, ENDS["left"], FAR["left"])


class _UnstagedError(Exception):
    """The command names what a town cannot stage."""


def stage_of(acts: Sequence[Act]) -> CommandScene | None:
    """The scene of a labelled command; None where a town cannot stage it."""
    wanted = [act for act in acts if not act.purpose]
    if not wanted or any(act.act not in _VERBS for act in wanted):
        return None
    for start in _starts(wanted):
        try:
            return _staged(wanted, start)
        except _UnstagedError:
            continue
    return None


def _starts(acts: Sequence[Act]) -> tuple[Start, ...]:
    """Places where the acts can be begun, the likeliest first."""
    turns = [act for act in acts if act.act in ("turn", "straight") and not act.negated]
    side: Side | None = next((act.side for act in turns if act.act == "turn"), None)
    turned = next((k for k, act in enumerate(acts) if act.act == "turn" and not act.negated), len(acts))
    changes = [k for k, act in enumerate(acts) if act.act in ("lane", "keep") and _lane_side(act) is not None]
    if side is not None and any(_at_end(act) for act in turns):
        return (ENDS[side],)
    if len(turns) > 1 and turns[0].act == "straight" and not changes:
        return (FAR[side or "right"],)
    passed_up = any(act.act == "turn" and act.negated for act in acts) and bool(turns)
    if (passed_up or any(_counts(act) for act in acts)) and not changes:
        return (FAR[side or "right"],)
    if changes and changes[0] < turned:
        to_left = _lane_side(acts[changes[0]]) == "left"
        keeps = acts[changes[0]].act == "keep"  # in its lane already
        return (RIGHT_LANE,) if to_left != keeps else (LEFT_LANE,)
    if changes and side is not None:
        return (SIDE_STREETS[side],)
    if side == "left":
        return LEFT_LANE, SIDE_STREETS["left"]
    return RIGHT_LANE, SIDE_STREETS["right"]


def _counts(act: Act) -> bool:
    """True if an act names a junction by a number."""
    held = (None if act.place is None else act.place.ref, None if act.when is None else act.when.ref)
    return any(one is not None and one.kind in _COUNTED and (one.ordinal or 1) > 1 for one in held)


def _too_far(act: Act) -> bool:
    """True if an act names a junction beyond those that a town has in a row."""
    reference = None if act.place is None else act.place.ref
    return reference is not None and reference.kind in _COUNTED and (reference.ordinal or 1) > _MOST_COUNTED


def _at_end(act: Act) -> bool:
    return act.place is not None and act.place.ref is not None and act.place.ref.kind == "end_of_road"


def _lane_side(act: Act) -> Side | None:
    """The side to which an act leads or keeps among lanes."""
    return "left" if act.to == "leftmost" else "right" if act.to == "rightmost" else act.side


def _staged(acts: Sequence[Act], start: Start) -> CommandScene:
    """The scene at a start. Raises _UnstagedError."""
    named = tuple(reference for act in acts for reference, _ in _roles(act))
    scene = CommandScene(start, _ROLLING_MPS if acts[0].act in ("speed", "gap") else 0.0, named=named)
    way: tuple[Turn, ...] = ()
    changed = 0
    for act in acts:
        if _too_far(act):
            raise _UnstagedError
        if act.act == "turn" and (act.side is None or len(way) > 1 or (_at_end(act) and start not in ENDS.values())):
            raise _UnstagedError
        if act.act == "lane" or (act.act == "keep" and (act.side or act.to)):
            if not _can_change(scene, act, way, changed):
                raise _UnstagedError
            changed += 1
        for reference, role in _roles(act):
            _put(scene, reference, role, act, way)
        if act.act == "turn" and act.side is not None and not act.negated:
            way = (*way, act.side)
        if act.act == "straight" and not act.negated:
            way = (*way, "straight")
    return scene


def _can_change(scene: CommandScene, act: Act, way: tuple[Turn, ...], changed: int) -> bool:
    """True if there is the lane that an act names. A turn from a side street leads into the lane on its own side."""
    side = _lane_side(act)
    if act.to == "original":
        return changed > 0
    if act.to not in (None, "leftmost", "rightmost"):
        return False
    if not way:
        return not scene.side_street or side is None
    return (
        act.act == "lane"
        and scene.side_street
        and len(way) == 1
        and (changed > 0 or act.to is not None or side != way[0])
    )


def _roles(act: Act) -> list[tuple[Reference, str]]:
    """References of an act, with the part that each plays."""
    found: list[tuple[Reference, str]] = []
    if act.target is not None:
        found.append((act.target, act.act))
    elif act.act == "gap":
        found.append((Reference("vehicle", where="ahead"), "gap"))
    if act.place is not None and act.place.ref is not None:
        found.append((act.place.ref, "place"))
    if act.when is not None:
        known = act.when.type not in ("unless", "before") and (act.when.type != "if" or act.when.event == "clear")
        if act.when.event not in _EVENTS or not known:
            raise _UnstagedError
        if act.when.ref is not None:
            found.append((act.when.ref, act.when.event))
    return found


def _put(scene: CommandScene, reference: Reference, role: str, act: Act, way: tuple[Turn, ...]) -> None:
    if reference in scene.referents or reference.kind in _NEEDS_NOTHING:
        return
    kind = _KINDS.get(reference.kind)
    if kind is None or (reference.of is not None and reference.of.kind not in _ANYWHERE):
        raise _UnstagedError
    if reference.ordinal not in (None, 1):
        _row(scene, reference, kind, role, way)
        return
    if (before := spoken_of(reference, scene.referents)) is not None:
        scene.referents[reference] = scene.referents[before]
        return
    actor = _actor(scene, reference, kind, role, act, way)
    scene.referents[reference] = (len(scene.actors),)
    scene.actors.append(actor)
    _distract(scene, reference, actor, role)


def _row(scene: CommandScene, reference: Reference, kind: StagedKind, role: str, way: tuple[Turn, ...]) -> None:
    """Several alike along the kerb, the one of the ordinal among them."""
    free = (
        not way and scene.has_kerb and not scene.actors and reference.state in (None, "parked", "stopped", "standing")
    )
    if not free or role in ("follow", "gone", "yield", "clear") or reference.ordinal not in (2, 3, -1):
        raise _UnstagedError
    if (kind in _UNMOVING and reference.colour is not None) or reference.side == "left":
        raise _UnstagedError
    colour = "black" if reference.colour == "dark" else reference.colour
    scene.actors += [StagedActor(kind=kind, colour=colour, ahead_m=at, left_m=_aside_m(kind)) for at in _ROW_M]
    scene.referents[reference] = (2 if reference.ordinal == -1 else reference.ordinal - 1,)


def _aside_m(kind: StagedKind) -> float:
    return {"pedestrian": -3.6, "static": -2.4, "obstacle": -3.0}.get(kind, _KERB_M)


def _actor(
    scene: CommandScene, reference: Reference, kind: StagedKind, role: str, act: Act, way: tuple[Turn, ...]
) -> StagedActor:
    thing = kind in _UNMOVING
    if thing and (reference.colour is not None or role == "gone"):
        raise _UnstagedError
    colour: Colour | None = "black" if reference.colour == "dark" else reference.colour
    crosses = role in ("yield", "gone", "clear")
    if kind == "pedestrian" and crosses and not way:
        left = reference.side == "left"
        return StagedActor(
            kind=kind, colour=colour, ahead_m=46.0 if scene.side_street else 57.0, left_m=7.2 if left else -3.6,
            heading="right" if left else "left", speed_mps=1.3, for_m=12.0, near_m=36.0,
        )  # fmt: skip
    drives = kind != "pedestrian" and not thing
    if role == "gap":
        if way or not drives:
            raise _UnstagedError
        return StagedActor(kind=kind, colour=colour, ahead_m=28.0, drives=True, speed_mps=_ROLLING_MPS)
    moves = crosses or reference.state in ("oncoming", "moving", "turning", "crossing")
    if (
        ((role == "follow" and reference.state != "turning") or (role == "pass" and act.negated))
        and drives
        and not (reference.side or reference.where == "behind")
    ):
        turns: tuple[Turn, ...] = way or (("left",) if scene.start == LEFT_LANE else ("right",))
        # Where it goes decides, not the road; one that is not to be passed or followed goes straight on.
        if act.negated:
            turns = ("straight",)
        return StagedActor(kind=kind, colour=colour, ahead_m=18.0, drives=True, turns=turns)
    if role == "moves" and not way and kind != "pedestrian":
        return StagedActor(kind=kind, colour=colour, ahead_m=16.0, speed_mps=7.0, after_s=6.0, for_m=200.0)
    if moves and drives and not way and act.act == "lane" and act.side is not None:
        aside = _LANE_M if act.side == "left" else -_LANE_M  # comes by in the lane that is changed into
        return StagedActor(kind=kind, colour=colour, ahead_m=-4.0, left_m=aside, drives=True, speed_mps=9.0)
    if reference.state == "turning" or (moves and reference.side == "right") or reference.where == "behind":
        raise _UnstagedError
    if moves and drives and not way:
        return StagedActor(kind=kind, colour=colour, ahead_m=45.0, left_m=7.0, heading="against", speed_mps=7.0)
    walks = kind == "pedestrian" and reference.state in ("walking", "moving")
    if reference.state not in (None, "parked", "stopped", "standing") and not walks:
        raise _UnstagedError
    if act.act == "lane" and not way and act.side is not None and kind != "pedestrian" and reference.state != "parked":
        if role == "near":
            return StagedActor(kind=kind, colour=colour, ahead_m=46.0)
        if not thing and role in ("passed", "place"):
            return StagedActor(
                kind=kind, colour=colour, ahead_m=20.0, left_m=_LANE_M if act.side == "left" else -_LANE_M
            )
    if reference.side == "left" and not way:
        return _on_the_left(scene, reference, kind, colour, walks=walks)
    if not way and not scene.has_kerb:
        raise _UnstagedError
    wide = _LEFT_TURN_M if way and way[-1] == "left" else 0.0
    places = _KERB_PLACES_M if not way else tuple(at + wide + _SECOND_TURN_M * (len(way) - 1) for at in _AFTER_TURN_M)
    used = sum(one.left_m in (_KERB_M, -3.6, -2.4, -3.0) and bool(one.way) == bool(way) for one in scene.actors)
    if used >= len(places):
        raise _UnstagedError
    at = (
        20.0
        if reference.where == "near" and not way
        else places[used] - (6.0 if scene.side_street and not way else 0.0)
    )
    pace = 0.7 if walks else 0.0
    return StagedActor(kind=kind, colour=colour, ahead_m=at, left_m=_aside_m(kind), way=way, speed_mps=pace, for_m=12.0)


def _on_the_left(
    scene: CommandScene, reference: Reference, kind: StagedKind, colour: Colour | None, *, walks: bool
) -> StagedActor:
    """One that stands in the lane beside ours, or on the other side of a street of one lane each way."""
    if scene.side_street:
        heading = "right" if kind == "pedestrian" and not walks else "against"
        pace = 0.7 if walks else 0.0
        return StagedActor(
            kind=kind,
            colour=colour,
            ahead_m=34.0,
            left_m=_OVER_THE_STREET_M,
            heading=heading,
            speed_mps=pace,
            for_m=8.0,
        )
    if walks or reference.state == "parked":
        raise _UnstagedError
    if scene.start == RIGHT_LANE and kind not in ("pedestrian", "bicycle"):
        return StagedActor(kind=kind, colour=colour, ahead_m=34.0, left_m=_LANE_M)
    raise _UnstagedError


def _distract(scene: CommandScene, reference: Reference, actor: StagedActor, role: str) -> None:
    """Put a distractor at the kerb, nearer than what is meant."""
    if not (scene.has_kerb or actor.way):
        return
    plural = reference.kind in ("vehicles", "traffic", "pedestrians", "vehicle", "obstacle", "cone", "barrier")
    if plural or role in ("gone", "yield", "clear"):
        return
    if reference.colour is not None and reference.kind != "van":
        alike: list[tuple[StagedKind, Colour | None]] = [
            (actor.kind, colour) for colour in _COLOURS if colour != actor.colour
        ]
    else:
        alike = [(_OTHER.get(actor.kind, "car"), None)]
    others = [one for one in scene.named if one != reference]
    chosen = next((one for one in alike if not any(_may_be(other, *one) for other in others)), None)
    if chosen is None:
        return
    kind, colour = chosen
    aside = -3.6 if kind == "pedestrian" else _KERB_M
    at = actor.ahead_m - 24.0 if actor.way else 24.0 if actor.ahead_m > 36.0 else 44.0 if scene.side_street else 50.0
    scene.actors.append(StagedActor(kind=kind, colour=colour, ahead_m=at, left_m=aside, way=actor.way))


def _may_be(reference: Reference, kind: StagedKind, colour: Colour | None) -> bool:
    """True if a reference could mean something of a kind and colour; one that is drawn may be any."""
    return _KINDS.get(reference.kind) == kind and (None in (reference.colour, colour) or reference.colour == colour)
