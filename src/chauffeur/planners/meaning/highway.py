"""Acts on a highway, at a merge or a crossing, as steps of the driving dialect; and what of them no step can say.

The inverse of `dialect_acts`: an act is looked up by what was said of it. What was said besides and decides nothing
("speed *up* to 60") is left out; a number keeps the unit it was said in.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

from chauffeur.concept import History, ProgramError, Situation
from chauffeur.concept.utterance import Act, Condition, Reference, ReferenceKind, Verb
from chauffeur.language.meaning.reader import read
from chauffeur.planners.meaning.compose import Undoable
from chauffeur.planners.meaning.dialect_acts import SKILL_ACTS
from chauffeur.planners.onboard.dialect import MAX_STEPS, SKILLS, DialectStep, Kind, Number, StepCondition
from chauffeur.planners.onboard.dialect import read as read_program
from chauffeur.planners.onboard.options import unit_of_bare

_LESS, _MORE = 0.85, 1.15
"""Of a remembered number: "as last time, but a little less"."""
_UNITS: Final[Mapping[str, tuple[Kind, str, float]]] = {
    "km/h": ("speed", "kmh", 1.0), "mph": ("speed", "mph", 1.0), "m/s": ("speed", "", 1.0),
    "m": ("distance", "", 1.0), "km": ("distance", "", 1000.0), "ft": ("distance", "feet", 1.0),
    "yd": ("distance", "yards", 1.0), "lengths": ("distance", "car_lengths", 1.0),
    "s": ("time", "", 1.0), "share": ("factor", "", 1.0), "lanes": ("lanes", "", 1.0),
}  # fmt: skip
"""A unit as said: what it measures, the dialect's unit function, and what its number is multiplied with."""
_LEADS: Final[frozenset[ReferenceKind]] = frozenset(
    {"car", "truck", "bus", "van", "motorcycle", "bicycle", "vehicle", "vehicles", "traffic", "other"}
)
"""Names of a lead vehicle."""
_PLACES: Final[frozenset[ReferenceKind]] = frozenset(
    {"building", "landmark", "lot", "gate", "driveway", "parking_space", "roundabout", "sidewalk", "end_of_road"}
)
"""Places that these roads do not have."""
_OTHER_SIDE: Final = {"left": "right", "right": "left"}
_FIELDS: Final = ("side", "to", "direction", "measure", "degree", "aim", "style")
_UNDECIDING: Final = ((), ("degree",), ("degree", "direction"), ("degree", "direction", "style", "aim"))
"""Fields that are left out, one group after the other, until a skill is found: "speed up to 60" is "drive at 60"."""
_INSTEAD: Final[Mapping[Verb, str]] = {
    "pass": "no_overtaking", "lane": "keep_lane", "speed": "hold_speed", "gap": "hold_gap", "yield": "hold_gap",
    "stop": "carry_on", "pull_over": "carry_on", "park": "carry_on", "wait": "carry_on", "turn": "go_straight",
}  # fmt: skip
"""What is done where an act is not to be done and nothing else is asked for."""
_BOUNDS: Final = {
    ("speed", "faster"): "at_most", ("speed", "slower"): "at_least",
    ("gap", "less"): "gap_at_least", ("gap", "more"): "gap_at_most",
}  # fmt: skip
"""What "not faster than 100" is."""
_ONCE: Final = ("yield", "follow", "keep", "resume", "style", "pull_over", "stop")
"""Said twice it is done once; two lanes to the left are said as one and another."""
_ASKED: Final[Mapping[Verb, str]] = {
    "speed": "Shall I drive faster or slower, or at a speed you name?",
    "gap": "Shall I close up or drop back, or keep a distance you name?",
    "turn": "Which way shall I turn, left or right?",
    "again": "What shall I do again?",
    "undo": "What shall I undo?",
    "pick": "Which one do you mean?",
    "unclear": "What shall I do: speed, distance, lane, overtaking, turning, or stopping?",
}  # fmt: skip
_CANNOT: Final[Mapping[Verb, str]] = {
    "u_turn": "one does not turn round on this road",
    "enter": "I keep to this road",
    "exit": "I see no exit",
    "goto": "I know no places here",
    "move": "I keep to the middle of the lane",
    "avoid": "I keep my distance to everybody as it is",
    "wait": "I do not stand still on this road for that",
    "refuse": "that is nothing I drive",
}
_MANNERS: Final = {"slow": "gently", "careful": "gently", "quick": "quickly"}
_UNTOLD: Final = "I cannot tell when that is"


@dataclass(frozen=True, slots=True)
class SpokenSteps:
    """Acts as steps of the dialect.

    Attributes:
        steps: What is to be driven.
        done: The acts that they do.
        undoable: The others.
        question: What to ask where an act is not clear; there are no steps then.
        assumed: What was taken for granted, full sentences.
    """

    steps: tuple[DialectStep, ...] = ()
    done: tuple[Act, ...] = ()
    undoable: tuple[Undoable, ...] = ()
    question: str = ""
    assumed: tuple[str, ...] = ()


class _UndoableError(Exception):
    """An act cannot be said as a step; its text says why."""


class _UnclearError(Exception):
    """An act is not clear; its text is the question."""


def steps_of(acts: Sequence[Act], situation: Situation, before: Sequence[DialectStep] = ()) -> SpokenSteps:
    """The steps that acts ask for.

    Args:
        acts: In the order in which they are to be done.
        situation: Where we are: a number without a unit is in the unit of the signs.
        before: What was driven on an earlier trip, for "as last time".
    """
    does = (
        act for act in acts if not act.purpose or act.act == "pass"
    )  # "the left lane, to overtake": it is overtaken
    wanted = [act for act in does if act.act not in ("none", "yes", "no", "cancel")]
    return _Speaker(wanted, situation, before).spoken()


def steps_before(history: History) -> tuple[DialectStep, ...]:
    """Steps of the most recent remembered trip: of its own program, or of its words."""
    if not history.items:
        return ()
    last = history.items[0]
    try:
        return read_program(last.policy)
    except ProgramError:
        return steps_of(read(last.instruction).acts, Situation("highway", 25.0, 30.0, 2, 1, False, None, None)).steps


class _Speaker:
    def __init__(self, acts: Sequence[Act], situation: Situation, before: Sequence[DialectStep]) -> None:
        self._acts, self._situation, self._before = acts, situation, before
        self._steps: list[DialectStep] = []
        self._assumed: list[str] = []
        self._wait: Number | None = None

    def spoken(self) -> SpokenSteps:
        done: list[Act] = []
        undoable: list[Undoable] = []
        for act in self._acts:
            try:
                found = list(self._steps_for(act))
            except _UndoableError as error:
                undoable.append(Undoable(act, str(error)))
                continue
            except _UnclearError as error:
                return SpokenSteps(question=str(error))
            if len(self._steps) + len(found) > MAX_STEPS:
                undoable.append(Undoable(act, f"I remember {MAX_STEPS} things at a time; tell me that later"))
                continue
            done.append(act)
            if found and found == self._steps[-1:] and SKILLS[found[0].skill].meaning.manoeuvre in _ONCE:
                continue
            if found:
                found[0] = replace(found[0], wait_s=self._wait or found[0].wait_s)
                self._wait = None
            self._steps += found
        if _opposed(self._steps):
            return SpokenSteps(question="You say both, more and less: which one do you want?")
        return SpokenSteps(tuple(self._steps), tuple(done), tuple(undoable), assumed=tuple(self._assumed))

    def _steps_for(self, act: Act) -> Iterator[DialectStep]:
        """Steps of an act; none where another act says it already. Raises _UndoableError, _UnclearError."""
        if act.act == "again":
            yield from self._again(act)
            return
        if act.act in ("yield", "wait") and act.when is not None and act.when.ref is not None:
            act = replace(act, target=act.target or act.when.ref, when=None)
        if act.act == "wait":
            if act.when is not None and act.when.event == "time":
                self._wait = self._seconds(act.when)
                return
            if act.target is not None and act.target.kind in _LEADS:
                act = replace(act, act="yield")
        if act.act in _CANNOT and not act.negated:
            raise _UndoableError(_CANNOT[act.act])
        act = self._sided(act)
        self._look_at_references(act)
        condition, wait, patient = self._conditions(act)
        if act.act == "lane" and act.to == "original" and self._back(act):
            return
        if act.act == "pass" and not act.negated and act.side is None and self._way_past():
            act = replace(act, side="left" if self._steps.pop().skill == "lane_left" else "right")
        skill, number = self._skill(act, patient=patient)
        if skill:
            manner = "" if act.act == "go" else _MANNERS.get(act.manner or "", "")
            yield DialectStep(skill, number, manner, wait, condition)

    # Acts that others change ------------------------------------------------------------------------------------------

    def _back(self, act: Act) -> bool:
        """True if the way back is part of the step before, which is changed then; a change of lanes has its own."""
        last = self._steps[-1] if self._steps else None
        if last is not None and f"{last.skill}_and_return" in SKILLS:
            self._steps[-1] = replace(last, skill=f"{last.skill}_and_return")
            return True
        side = act.side or next((_OTHER_SIDE[one] for one in _OTHER_SIDE if last and last.skill == f"lane_{one}"), None)
        if side is None:
            return False
        self._steps.append(DialectStep(f"lane_{side}"))
        return True

    def _sided(self, act: Act) -> Act:
        """A change of lanes with the side that its words name elsewhere, and where no lane is there, the turn to it;
        driving on at a crossing, with its way.
        """
        here = self._situation
        if act.act == "lane" and act.to is None and act.value is None:
            named = (act.target, act.place and act.place.ref, act.when and act.when.ref)
            side = act.side or next((one.side for one in named if one and one.side), None)
            beside = here.lane_index + (-1 if side == "left" else 1)
            turns = side in here.turns and not 0 <= beside < here.lane_count and not act.negated and act.place is None
            return replace(act, act="turn" if turns else "lane", side=side)
        plain = act.style is None and act.manner is None and not act.negated
        crosses = act.place is not None and act.place.ref is not None and act.place.ref.kind == "junction"
        on = act.act == "go" and plain and (crosses or "straight" in here.turns)
        return replace(act, act="straight") if on else act

    def _way_past(self) -> bool:
        """True if the step before is a change of lanes that an overtaking begins with."""
        last = self._steps[-1] if self._steps else None
        return last is not None and last in (DialectStep("lane_left"), DialectStep("lane_right"))

    def _again(self, act: Act) -> Iterator[DialectStep]:
        """The steps driven before, more or less of them, or to the other side."""
        if not self._before:
            raise _UnclearError(_ASKED["again"])
        for step in self._before:
            takes = SKILLS[step.skill].takes
            if step.number is not None and takes is not None and act.value is not None:
                change = self._number(replace(act, direction=None), takes).si
                lower = act.direction in ("less", "slower")
                value = change if act.measure is None and act.direction is None else step.number.si + (
                    -change if lower else change
                )  # fmt: skip
                yield replace(step, number=Number(max(0.0, round(value, 4))))
            elif step.number is not None and act.direction in ("less", "more", "slower", "faster"):
                factor = _LESS if act.direction in ("less", "slower") else _MORE
                yield replace(step, number=replace(step.number, factor=factor))
            elif act.direction in ("less", "more") and (skill := _stronger(step.skill, act.direction)):
                yield replace(step, skill=skill)
            elif act.side is not None:
                yield replace(step, skill=step.skill.replace(_OTHER_SIDE[act.side], act.side))
            else:
                yield step

    # One act ----------------------------------------------------------------------------------------------------------

    def _skill(self, act: Act, *, patient: bool) -> tuple[str, Number | None]:
        """The skill of an act with its number; an empty name where nothing is left to be done."""
        if act.negated:
            return self._forbidden(act)
        act = _completed(act)
        if act.unit == "share" and act.value is not None:
            share = act.value if act.measure == "times" or act.measure is None else self._share(act)
            act = replace(act, value=share, measure="times", direction=None)
        name = _nearest(act, patient=patient)
        if name is None:
            raise _UnclearError(_ASKED[act.act]) if act.act in _ASKED else _UndoableError("I do not know how")
        if name == "gap_of" and act.unit == "s":
            name = "gap_of_seconds"
        takes = SKILLS[name].takes
        if takes is None:
            return name, None
        number = self._number(act, takes)
        if name in ("lanes_left", "lanes_right") and number.value <= 1.0:
            return name.replace("lanes", "lane"), None
        return name, number

    def _share(self, act: Act) -> float:
        """The factor of a change by a share."""
        assert act.value is not None
        if act.direction is None:
            raise _UnclearError(_ASKED[act.act])
        return 1.0 + act.value if act.direction in ("faster", "more") else max(0.0, 1.0 - act.value)

    def _forbidden(self, act: Act) -> tuple[str, Number | None]:
        if any(one.act == act.act and not one.negated for one in self._acts):
            return "", None  # "not the left lane, the right one"
        if act.value is not None and (bound := _BOUNDS.get((act.act, act.direction or ""))) is not None:
            return bound, self._number(act, SKILLS[bound].takes or "speed")
        if act.value is not None or act.act not in _INSTEAD:
            raise _UnclearError("You say what you do not want. What shall I do instead?")
        if any(not one.negated for one in self._acts):
            return "", None  # what else is asked for is driven, and nothing but that
        return _INSTEAD[act.act], None

    def _number(self, act: Act, takes: Kind) -> Number:
        """The number of an act, in the unit it was said in."""
        assert act.value is not None
        if not 0.0 <= act.value < 10_000.0:
            raise _UndoableError(f"{act.value:g} is no number I can drive")
        kind, unit, factor = _UNITS.get(act.unit, (takes, "", 1.0))
        if kind == "time" and takes == "distance":
            return Number(round(act.value * max(self._situation.speed_mps, 1.0), 1))
        if kind != takes:
            words = {"speed": "a speed", "distance": "a distance", "time": "a time"}.get(takes, "a number of that kind")
            raise _UndoableError(f"I cannot make {words} of {act.value:g} {act.unit}")
        if takes == "speed" and not act.unit:
            change = {"faster": 1, "slower": -1}.get(act.direction or "", 0)
            unit, said = unit_of_bare(act.value, self._situation, 0 if act.measure else change)
            self._assumed.append(said)
        return Number(act.value * factor, unit)

    # What it waits for, and whom it is about --------------------------------------------------------------------------

    def _look_at_references(self, act: Act) -> None:
        """Raises _UndoableError for what is not on these roads."""
        if act.act in ("gap", "follow", "pass") and act.target is not None:
            if act.target.where == "behind":
                raise _UndoableError("I can keep a distance to the vehicle ahead only")
            if act.target.kind not in _LEADS:
                raise _UndoableError("I see none of these here")
        place = None if act.place is None else act.place.ref
        if place is not None and place.kind in _PLACES and act.act not in ("turn", "straight"):
            raise _UndoableError("I know no such place here")

    def _conditions(self, act: Act) -> tuple[StepCondition | None, Number | None, bool]:
        """(what is tested, what is waited, whether the lane must be clear)."""
        when = act.when
        if when is None:
            return None, None, False
        if when.event == "told" or (when.event in ("passed", "gone", "clear") and act.act in ("yield", "pass")):
            return None, None, False  # lasts anyway; or is how it is done
        if when.type not in ("once", "if", "after"):
            raise _UndoableError(_UNTOLD)
        if when.event == "time":
            return None, self._seconds(when), False
        how = "if" if when.type == "if" else "once"
        if when.event in ("slower", "closer", "further") and when.value is not None:
            takes: Kind = "speed" if when.event == "slower" else "distance"
            number = self._number(replace(act, value=when.value, unit=when.unit, direction=None, measure=None), takes)
            return StepCondition(how, f"lead_{when.event}_than", number), None, False
        if when.event == "clear":
            side = _side_of(when.ref) or act.side
            if act.act == "lane" and side == act.side and act.to is None and act.value is None:
                return None, None, True  # whether it is clear is looked at until it is: so are lanes changed
            if side is not None:
                return StepCondition(how, f"clear_{side}"), None, False
            if act.act in ("turn", "straight", "go", "lane", "pull_over", "park"):
                return None, None, False  # none of these is done before it is clear
        raise _UndoableError(_UNTOLD)

    def _seconds(self, when: Condition) -> Number:
        if when.value is None or when.unit != "s":
            raise _UndoableError(_UNTOLD)
        return Number(when.value)


def _side_of(reference: Reference | None) -> str | None:
    return None if reference is None else reference.side


def _completed(act: Act) -> Act:
    """An act with what its words say elsewhere than in its own fields."""
    if act.act == "speed":
        about_traffic = act.target is not None and act.value is None and act.direction in (None, "same")
        act = replace(act, aim="traffic", direction=None) if about_traffic else act
    if act.act == "speed" and act.measure in ("over_limit", "under_limit"):
        act = replace(act, aim="limit", direction=None)
    if act.act == "go" and act.style is None and act.manner is not None:
        pace = {"slow": "slower", "quick": "faster"}.get(act.manner)
        act = replace(act, style="careful") if pace is None else replace(act, act="speed", direction=pace)  # type: ignore[arg-type]
        act = replace(act, manner=None)
    if act.act in ("stop", "park"):
        act = replace(act, act="stop" if act.act == "stop" else "pull_over", side=None)
    return replace(act, side=None) if act.act in ("pull_over", "yield", "follow", "keep", "speed", "gap") else act


def _nearest(act: Act, *, patient: bool) -> str | None:
    """The skill that says an act best; None where none does."""
    said = _parts(act) | (_PATIENT if patient else frozenset())
    if act.style is not None and act.value is None and act.act in ("go", "speed"):
        return _BY_STYLE[act.style]
    for left_out in _UNDECIDING:
        kept = frozenset(part for part in said if part.partition(":")[0] not in left_out)
        if (found := _BY_PARTS.get(kept)) is not None:
            return found
    return None


def _parts(act: Act) -> frozenset[str]:
    """Fields of an act in the notation of `SKILL_ACTS`, without its target."""
    fields = {f"{name}:{value}" for name in _FIELDS if (value := getattr(act, name)) is not None}
    marks = [mark for mark, said in (("NOT", act.negated), ("VALUE", act.value is not None)) if said]
    return frozenset({act.act, *fields, *marks})


def _of_label(label: str) -> frozenset[str]:
    """The same of a skill's label."""
    return frozenset(label.partition(" T ")[0].split())


def _opposed(steps: Sequence[DialectStep]) -> bool:
    """True if two steps at once ask for more and for less of the same."""
    for one, other in pairwise(steps):
        first, second = one.meaning, other.meaning
        plain = other.wait_s is None and other.condition is None and one.condition is None
        if plain and first.manoeuvre == second.manoeuvre and first.change * second.change < 0:
            return True
    return False


def _stronger(skill: str, direction: str) -> str | None:
    """A skill with more or less of it: "a bit faster" for "faster"; None where there is none."""
    base = skill.removeprefix("a_bit_").removeprefix("much_")
    known = [name for name in (f"a_bit_{base}", base, f"much_{base}") if name in SKILLS]
    at = known.index(skill) + (1 if direction == "more" else -1) if skill in known else -1
    return known[at] if 0 <= at < len(known) else None


_PATIENT: Final = frozenset({"W:once", "E:clear"})
_BY_PARTS: Final[Mapping[frozenset[str], str]] = {
    _of_label(label): name for name, label in reversed(tuple(SKILL_ACTS.items())) if " + " not in label
}
"""Of two skills of the same parts the first: `gap_of` before `gap_of_seconds`, which its unit tells apart."""
_BY_STYLE: Final[Mapping[str, str]] = {
    part.removeprefix("style:"): name
    for name, label in SKILL_ACTS.items()
    for part in label.split()
    if part.startswith("style:")
}
