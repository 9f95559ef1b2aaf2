"""From acts and what they refer to, to a program of the driving language, and to what cannot be done, in words."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

from chauffeur.concept import Limits, Observation, Situation, VehicleState
from chauffeur.concept.dialogue import ANSWERS, DIALOGUE
from chauffeur.concept.sight import AT_KERB_M, states_of
from chauffeur.concept.units import MPS_PER_KMH, MPS_PER_MPH
from chauffeur.concept.utterance import Act, ActPlace, Condition, Reference, Side, Utterance, Verb
from chauffeur.language.ground import PLURALS, ROAD_USERS, Grounded, Target, ground, spoken_of
from chauffeur.language.meaning.words import act_words, reference_words
from chauffeur.planners.meaning.helpers import helpers_used

ANY_PACE: Final = 70.0
"""m/s: no slower than the limit."""
_SLOW_SHARE: Final = 0.5
_SLOWER: Final = 0.6
_LEAST_MPS: Final = 2.0
_LOOKING_MPS, _LOOKS_FROM_M = 7.0, 18.0
"""Behind a junction what is to be found there is looked for from so far on, at no more than this speed."""
_CHANGES_FROM_M: Final = 6.0
"""From where a junction begins to where a lane change is first tried, which waits for the lane: blocks are short."""
_STOPS_FROM_M: Final = 48.0
"""From where a junction begins to where one stands behind it."""
_LAST_STEPS: Final = 1200
_STOOD_STEPS: Final = 60
_FOLLOWED_STEPS: Final = 900
"""What is told after following begins so much later."""
_WAITED_STEPS: Final = 100
_STEPS_A_S: Final = 20
_MOST_USERS: Final = 6
_MOST_JUNCTIONS: Final = 8
_WIDTH_M: Final = 1.9
"""A road user that stands nearer to the middle of our way than this is in it."""
_WAYS: Final = {"left": "to the left", "right": "to the right", "straight": "straight on"}
_TAGS: Final[dict[Verb, str]] = {"straight": "turn.straight", "goto": "go_to", "pass": "overtake", "go": "keep"}
_MOVES_ON: Final[frozenset[Verb]] = frozenset({"turn", "straight", "go", "lane", "follow"})
"""Acts after which other things come into sight."""
_STANDS: Final[frozenset[Verb]] = frozenset({"stop", "park", "pull_over"})
_CANNOT: Final[dict[Verb, str]] = {
    "u_turn": "I do not turn round on the street",
    "enter": "I do not drive off the street",
    "exit": "I do not drive off the street",
    "goto": "the place is not in sight; name it alone, and I take you there",
    "move": "I keep to the middle of the lane",
    "refuse": "that is nothing a car does",
    **dict.fromkeys(DIALOGUE - ANSWERS, "I do not know what that goes back to"),
}
_EVENTS: Final = {
    "opens": "I cannot see whether it opens",
    "arrives": "I cannot tell when somebody arrives",
    "told": "say it again when I am to do it",
    "red": "I do not set off on red",
    "slower": "I do not wait here for another vehicle's speed",
    "closer": "I do not wait here for a distance",
    "further": "I do not wait here for a distance",
    "other": "I do not know how to see that",
}


@dataclass(frozen=True, slots=True)
class Undoable:
    """An act that cannot be done, and why, in words for the passenger."""

    act: Act
    reason: str


@dataclass(frozen=True, slots=True)
class ComposedActs:
    """Acts as a program.

    Attributes:
        source, library: The program; empty where nothing can be done.
        intent: Tags of the acts that it does.
        done: The acts that it does, in order.
        undoable: The others.
        question: Where a reference is not clear: what to ask; nothing is composed then.
        referents: Each reference that was resolved, and what it means.
        told: What is done, sentence by sentence.
    """

    source: str = ""
    library: str = ""
    intent: str = ""
    done: tuple[Act, ...] = ()
    undoable: tuple[Undoable, ...] = ()
    question: str = ""
    referents: tuple[Grounded, ...] = ()
    told: tuple[str, ...] = ()


def compose(utterance: Utterance, observation: Observation, situation: Situation, limits: Limits) -> ComposedActs:
    """A program that does the acts of an utterance one after the other, as far as they can be done from here."""
    acts = [act for act in utterance.acts if not act.purpose and act.act not in ANSWERS and act.act != "none"]
    return _Composer(acts, observation, situation, limits).composed()


class _UndoableError(Exception):
    """An act cannot be done; its text says why."""


class _UnclearError(Exception):
    """A reference is not clear; its text is the question."""


class _Composer:
    def __init__(self, acts: Sequence[Act], observation: Observation, situation: Situation, limits: Limits) -> None:
        self._acts, self._seen, self._situation, self._limits = acts, observation, situation, limits
        self._pace = ANY_PACE
        self._referents: dict[Reference, Grounded] = {}
        self._moved_on = False
        """True if an act before leads to where other things are in sight."""
        self._turned = False
        self._changed: Side | None = None
        """The side to which lanes were changed last."""
        self._looked_for: Reference | None = None
        """What the program looks for behind a turn, and calls `who`."""
        self._last = False
        self._next: Act | None = None

    def composed(self) -> ComposedActs:
        body: list[str] = []
        done: list[Act] = []
        told: list[str] = []
        undoable: list[Undoable] = []
        for k, act in enumerate(self._acts):
            self._last = k == len(self._acts) - 1
            self._next = None if self._last else self._acts[k + 1]
            try:
                lines = list(self._lines(act))
            except _UndoableError as error:
                undoable.append(Undoable(act, str(error)))
                continue
            except _UnclearError as error:
                return ComposedActs(question=str(error), referents=tuple(self._referents.values()))
            body += [f"    # {act_words(act).replace('—', '-')}", *(f"    {line}" for line in lines)]
            done.append(act)
            told.append(self._told(act))
            self._moved_on = self._moved_on or (act.act in _MOVES_ON and not act.negated)
            self._turned = self._turned or (act.act == "turn" and not act.negated)
        referents = tuple(self._referents.values())
        if not done:
            return ComposedActs(undoable=tuple(undoable), referents=referents)
        if not (done[-1].act in _STANDS or done[-1].act == "wait") or done[-1].negated:
            body.append(f"    yield from drive_on(200, {self._pace:g})")
        source = "\n".join(["def as_told():", *body, ""])
        return ComposedActs(
            source,
            helpers_used(source),
            "+".join(dict.fromkeys(_tag(act) for act in done)),
            tuple(done),
            tuple(undoable),
            referents=referents,
            told=tuple(told),
        )

    # Acts -------------------------------------------------------------------------------------------------------------

    def _lines(self, act: Act) -> Iterator[str]:
        """Lines of the program for an act. Raises _UndoableError, _UnclearError."""
        if act.negated:
            yield from self._forbidden(act)
            return
        if act.act in _CANNOT:
            raise _UndoableError(_CANNOT[act.act])
        if act.act == "wait":
            yield from self._wait(act)
            return
        held = self._pace
        if act.manner in ("slow", "careful") and act.act != "speed":
            self._pace = min(held, self._limit_mps * _SLOW_SHARE)
        until = act.when is not None and act.when.type in ("until", "while")
        if act.when is not None and not until:
            yield from self._before(act.when, act)
        doing: dict[Verb, Callable[[Act], Iterator[str]]] = {
            "follow": self._follow, "pass": self._pass, "avoid": self._pass, "yield": self._yield, "stop": self._stop,
            "park": self._stop, "pull_over": self._stop, "go": self._go, "turn": self._turn,
            "straight": self._turn, "lane": self._lane, "keep": self._keep, "speed": self._speed, "gap": self._gap,
        }  # fmt: skip
        yield from doing[act.act](act)
        if act.act != "speed":
            self._pace = held

    def _forbidden(self, act: Act) -> Iterator[str]:
        """Lines for an act that is denied: the other acts, or following the road."""
        if any(not one.negated and one.act in _MOVES_ON | _STANDS for one in self._acts):
            return
        if act.act == "turn" and "straight" in self._situation.turns:
            yield "go_straight_at_next_intersection()"
            yield f"yield from cross_the_junction({self._pace:g})"
        elif act.act == "turn" and act.side is not None and self._situation.turns:
            other = next((turn for turn in self._situation.turns if turn != act.side), None)
            if other is None:
                raise _UndoableError(f"the road leads {_WAYS[act.side]} only")
            yield f"turn_{other}_at_next_intersection()"
            yield f"yield from cross_the_junction({self._pace:g})"
        elif act.act == "go":
            yield "yield from halt(200)"
        elif act.act == "pass" and act.target is not None and act.target.state not in ("parked", "stopped"):
            yield from self._follow(replace(act, act="follow", negated=False))
        elif act.act in ("stop", "park", "pull_over", "lane", "pass", "speed", "follow", "u_turn"):
            yield f"yield from drive_on(200, {self._pace:g})"
        else:
            raise _UndoableError("I do not know how to keep from that")

    def _follow(self, act: Act) -> Iterator[str]:
        who = self._user(act.target, act) if act.target is not None else None
        if who is None:
            raise _UndoableError("I do not know whom to follow")
        for line, name in who:
            yield from line
            steps = _LAST_STEPS * 6 if self._last else _FOLLOWED_STEPS
            if act.when is not None and act.when.type == "until":
                raise _UndoableError("I cannot tell beforehand when to stop following")
            yield f"yield from keep_behind({name}, {steps})"
            return

    def _pass(self, act: Act) -> Iterator[str]:
        if act.target is None:
            yield f"yield from drive_on(100, {self._pace:g})"
            return
        for lines, name in self._user(act.target, act):
            blocks = self._in_our_way(act.target)
            if blocks and not any(
                0 <= self._situation.lane_index + side < self._situation.lane_count for side in (-1, 1)
            ):
                raise _UndoableError("it is in our lane, and there is no lane beside it to pass in")
            yield from lines
            if blocks:
                yield "if not change_lane_left():"
                yield "    change_lane_right()"
            yield f"yield from until_passed({name}, {self._pace:g})"

    def _yield(self, act: Act) -> Iterator[str]:
        target = act.target
        if target is None or (target.kind in PLURALS and not ground(target, self._seen).fits):
            yield f"yield from until_clear({self._pace:g})"
            return
        for lines, name in self._user(target, act):
            yield from lines
            yield f"yield from let_go({name})"

    def _wait(self, act: Act) -> Iterator[str]:
        when = act.when
        if act.unit == "s" and act.value is not None:
            yield f"yield from halt({round(act.value * _STEPS_A_S)})"
            return
        if when is None:
            if act.target is not None:
                yield from self._yield(act)
                return
            if not self._last:
                yield f"yield from halt({_WAITED_STEPS})"
                return
            yield 'say("I wait here. Tell me when to go on.")'
            yield f"yield from halt({_LAST_STEPS * 5})"
            return
        yield from self._before(when, act)
        if self._last:
            yield f"yield from drive_on(100, {self._pace:g})"

    def _stop(self, act: Act) -> Iterator[str]:
        reference = act.target
        relation = "near"
        if act.place is not None and act.place.rel != "here":
            reference, relation = act.place.ref or reference, act.place.rel
        if (
            reference is not None
            and reference.of is not None
            and reference.kind in ("parking_space", "road", "sidewalk")
        ):
            reference, relation = reference.of, "near"
        if reference is None or reference.kind in ("me_here", "road", "lane", "sidewalk", "parking_space"):
            yield f"yield from halt({2 * _STOOD_STEPS})"
            return
        if reference.kind in ("light", "stop_sign", "junction", "crosswalk", "end_of_road"):
            self._grounded(reference, act)
            if relation in ("after", "behind") and reference.kind != "end_of_road":
                yield f"yield from cross_the_junction({self._pace:g}, {_STOPS_FROM_M:g})"
                yield f"yield from halt({2 * _STOOD_STEPS})"
            else:
                yield f"yield from stand_before_junction({self._pace:g})"
        elif reference.kind in ROAD_USERS:
            for lines, name in self._user(reference, act):
                yield from lines
                yield f"yield from stand_{self._stand(relation, reference)}({name})"
                break
        else:
            raise _UndoableError(f"I cannot make out {reference_words(reference)} here")
        if self._last:
            yield f"yield from halt({_STOOD_STEPS})"

    def _stand(self, relation: str, reference: Reference) -> str:
        """Side of a road user to stop at: behind, beside or beyond it."""
        agent = self._agent(reference)
        if agent is not None and self._in_our_way(reference):
            return "behind"  # past it nothing leads
        if relation in ("behind", "before"):
            return "behind"
        if relation == "after":
            return "beyond"
        if relation == "in_front_of":
            if agent is None or agent.kind in ("pedestrian", "static", "obstacle"):
                return "behind"
            faces_us = "oncoming" in states_of(replace(agent, speed_mps=1.0), self._seen)
            return "behind" if faces_us else "beyond"
        return "beside"

    def _go(self, act: Act) -> Iterator[str]:
        steps = 3 * _LAST_STEPS // 4 if self._last else 3 * _STOOD_STEPS
        if self._next is not None and self._next.act in ("turn", "straight", "lane"):
            steps = 20  # what follows is at the next junction, however near
        if act.when is not None and act.when.type == "until":
            yield from self._before(act.when, act)
            return
        yield f"yield from drive_on({steps}, {self._pace:g})"

    def _turn(self, act: Act) -> Iterator[str]:
        side = "straight" if act.act == "straight" else act.side
        if side is None:
            raise _UndoableError("I do not know which way")
        reference = None if act.place is None else act.place.ref
        nth = 1
        if reference is not None and reference.kind in ("junction", "road", "light", "driveway"):
            nth = max(1, reference.ordinal or 1)
            passed_up = any(one.act == "turn" and one.negated for one in self._acts)
            if nth == 1 and passed_up and act.place is not None and act.place.rel == "next":
                nth = 2  # "not this right, the next one"
        elif reference is not None and reference.kind in ROAD_USERS and act.place is not None:
            yield from self._past(act.place, reference, act)
        turns = self._situation.turns
        ends = reference is not None and reference.kind == "end_of_road"
        if nth == 1 and not ends and not self._moved_on and side not in turns:
            ways = " or ".join(_WAYS[turn] for turn in turns)
            raise _UndoableError(
                f"no way leads {_WAYS[side]} at the next junction, only {ways}"
                if ways
                else "there is no junction ahead"
            )
        if ends:
            yield f"yield from to_the_end({self._pace:g})"
            self._moved_on = True
        if nth > 1:
            yield f'yield from pass_ways("{side}", {nth - 1}, {self._pace:g})'
        on = self._next is not None and self._next.act == "turn"  # along the road, up to where it turns
        on = on or self._is_told_before_junction(self._next)
        if side == "straight" and reference is None and act.when is None and on:
            yield f"yield from drive_on(20, {self._pace:g})"
            return
        if side == "straight" and self._turned and nth == 1:  # along the street that the turn leads into
            yield 'if can_go("straight"):'
            yield "    go_straight_at_next_intersection()"
            yield f"yield from drive_on(240, {self._pace:g})"
            return
        if self._moved_on or nth > 1:
            yield "for _ in range(12000):"
            yield f'    if can_go("{side}"):'
            yield "        break"
            yield f"    yield proceed(min(check_speed_limit(), {self._pace:g}))"
        yield f"{'go_straight' if side == 'straight' else f'turn_{side}'}_at_next_intersection()"
        looks = self._next is not None and any(one.kind in ROAD_USERS for one in references_of(self._next))
        pace = min(self._pace, _LOOKING_MPS) if looks else self._pace
        beyond = (
            _LOOKS_FROM_M if looks else _CHANGES_FROM_M if self._next is not None and self._next.act == "lane" else 0.0
        )
        yield f"yield from cross_the_junction({pace:g}{f', {beyond:g}' if beyond else ''})"

    def _is_told_before_junction(self, act: Act | None) -> bool:
        """True if an act is done by a road user that is seen before the next junction."""
        if act is None or act.act not in _STANDS | {"avoid", "pass"}:
            return False
        users = [one for one in references_of(act) if one.kind in ROAD_USERS]
        fits = [target for one in users for target in ground(one, self._seen, act.act).fits]
        return any(self._before_junction(target) and target.forward_m > 0.0 for target in fits)

    def _past(self, place: ActPlace, reference: Reference, act: Act) -> Iterator[str]:
        """Lines that come past a road user by which a turn is told, where it is told so."""
        for lines, name in self._user(reference, act):
            if place.rel in ("after", "behind"):
                yield from lines
                yield f"yield from until_passed({name}, {self._pace:g})"
            return

    def _lane(self, act: Act) -> Iterator[str]:
        index, count = self._situation.lane_index, self._situation.lane_count
        side = act.side
        if act.to in ("leftmost", "rightmost"):
            side = "left" if act.to == "leftmost" else "right"
        elif act.to == "original" and self._changed is not None:
            side = "right" if self._changed == "left" else "left"
        elif act.to is not None:
            raise _UndoableError(f"I do not know the {act.to.replace('_', ' ')} lane here")
        elif side is None:
            side = "left" if index > 0 else "right"
        there = index + (-1 if side == "left" else 1)
        if not self._moved_on and act.to is None and not 0 <= there < count:
            raise _UndoableError(f"there is no lane to the {side} of ours")
        if act.place is not None and act.place.ref is not None and act.place.ref.kind in ROAD_USERS:
            for lines, name in self._user(act.place.ref, act):
                if act.place.rel in ("after", "in_front_of"):
                    yield from lines
                    yield f"yield from until_passed({name}, {self._pace:g})"
        self._changed = side
        yield f"yield from {'outermost' if act.to in ('leftmost', 'rightmost') else 'over'}_{side}({self._pace:g})"

    def _keep(self, act: Act) -> Iterator[str]:
        side = {"leftmost": "left", "rightmost": "right"}.get(act.to or "", act.side)
        if act.to not in (None, "leftmost", "rightmost"):
            raise _UndoableError(f"I do not know the {act.to} lane here")
        index, count = self._situation.lane_index, self._situation.lane_count
        there = index == 0 if side == "left" else index == count - 1
        if side is not None and (self._moved_on or not there):
            yield f"yield from outermost_{side}({self._pace:g})"
        yield from self._go(act)

    def _speed(self, act: Act) -> Iterator[str]:
        limit = self._limit_mps
        most = self._limits.most_mps(limit)
        if act.value is not None:
            factor = {"mph": MPS_PER_MPH, "m/s": 1.0}.get(act.unit, MPS_PER_KMH)
            self._pace = act.value * factor
            if self._pace > most:
                raise _UndoableError("that is faster than is allowed here")
        elif act.direction == "slower":
            now = max(self._situation.speed_mps, 0.6 * limit)
            self._pace = max(_LEAST_MPS, min(_SLOWER * now, _SLOWER * self._pace))
        elif act.direction == "faster":
            self._pace = ANY_PACE
        held = self._pace
        if act.when is not None and act.when.type in ("while", "until"):
            yield from self._before(act.when, act)
            self._pace = ANY_PACE
            return
        yield f"yield from drive_on({_LAST_STEPS // 2 if self._last else 2 * _STOOD_STEPS}, {held:g})"

    def _gap(self, act: Act) -> Iterator[str]:
        headway = 2.0 if act.direction == "more" else 1.0
        if act.value is not None:
            headway = act.value if act.unit == "s" else act.value / max(self._situation.speed_mps, 5.0)
        headway = min(max(headway, self._limits.min_time_headway_s), 2.0)
        yield f"set_desired_time_headway({headway:.2f})"
        yield f"yield from drive_on({_LAST_STEPS // 2 if self._last else 2 * _STOOD_STEPS}, {self._pace:g})"

    # Events -----------------------------------------------------------------------------------------------------------

    def _before(self, when: Condition, act: Act) -> Iterator[str]:
        """Lines that let an event come, driving on or standing as one does. Raises _UndoableError, _UnclearError."""
        if when.type in ("unless", "before"):
            raise _UndoableError(f"I cannot tell beforehand what is to come {when.type} that")
        if when.event in _EVENTS:
            raise _UndoableError(_EVENTS[when.event])
        pace = f"{self._pace:g}"
        if when.event == "time":
            if when.value is None or when.unit not in ("", "s"):
                raise _UndoableError("I do not know how long that is")
            steps = round(when.value * _STEPS_A_S)
            yield f"yield from halt({steps})" if act.act == "wait" else f"yield from drive_on({steps}, {pace})"
            return
        if when.event == "green":
            if not self._light_ahead:
                raise _UndoableError("I see no traffic light ahead")
            yield f"yield from until_green({pace})"
            return
        if when.ref is None or when.ref.kind not in ROAD_USERS:
            if when.event == "clear":
                yield f"yield from until_clear({pace})"
                return
            if when.event in ("near", "passed") and when.ref is not None and when.ref.kind in ("junction", "light"):
                self._grounded(when.ref, act)
                if when.event == "near":
                    yield f"yield from stand_before_junction({pace})"
                    return
                for _ in range(min(max(1, when.ref.ordinal or 1), _MOST_JUNCTIONS)):
                    yield f"yield from cross_the_junction({pace})"
                self._moved_on = True
                return
            raise _UndoableError("I do not know what that waits for")
        if when.event in ("gone", "clear") and when.ref.kind in PLURALS and not ground(when.ref, self._seen).fits:
            yield f"yield from until_clear({pace})"  # nobody in sight has to go: whoever comes is let go first
            return
        call = {
            "gone": "let_go({who})", "clear": "let_go({who})", "passed": f"until_passed({{who}}, {pace})",
            "moves": "until_moves({who})", "stopped": "until_stands({who})", "near": f"until_near({{who}}, {pace})",
        }[when.event]  # fmt: skip
        for lines, name in self._user(when.ref, act):
            yield from lines
            stays = when.event == "gone" and when.type == "until" and act.act == "wait"
            chosen = "stand_until_gone({who})" if stays and self._beside_us(when.ref) else call
            yield f"yield from {chosen.format(who=name)}"

    # References -------------------------------------------------------------------------------------------------------

    def _grounded(self, reference: Reference, act: Act) -> Grounded:
        found = self._referents.get(reference)
        before = spoken_of(reference, self._referents) if reference.kind in ROAD_USERS else None
        if found is None and before is not None:
            found = self._referents[reference] = self._referents[before]
        if found is None:
            found = ground(reference, self._seen, act.act)
            if found.question and self._moved_on:
                found = ground(replace(reference, deictic=True), self._seen, act.act)
            self._referents[reference] = found
        if found.question:
            raise _UnclearError(found.question)
        if found.absent and not self._moved_on:
            raise _UndoableError(found.absent.rstrip("."))
        return found

    def _user(self, reference: Reference, act: Act) -> Iterator[tuple[list[str], str]]:
        """Lines that name the road users which a reference means, and the name of each; such as come into sight after
        a turn are looked for there."""
        if reference.kind not in ROAD_USERS:
            raise _UndoableError(f"I cannot make out {reference_words(reference)} here")
        found = self._grounded(reference, act)
        here = found.targets
        if self._turned and act.act != "follow":  # what is told after a turn is on the street that it leads into
            here = tuple(one for one in here if not self._before_junction(one))
        passed = act.act in ("pass", "avoid") or (act.when is not None and act.when.event == "passed")
        targets = [one for one in here if self._matters(one, reference, parked=passed)][:_MOST_USERS]
        if targets:
            for one in targets:
                yield [], f"agent({one.agent})"
            return
        if here:
            return
        if self._looked_for is not None and spoken_of(reference, (self._looked_for,)) is not None:
            yield [], "who"
            return
        self._looked_for = reference
        self._referents[reference] = replace(found, targets=())
        kind = {"vehicles": "vehicle", "traffic": "vehicle", "pedestrians": "pedestrian"}.get(
            reference.kind, reference.kind
        )
        words = (json.dumps(part or "") for part in (kind, reference.colour, reference.state, reference.side))
        pace = min(self._pace, _LOOKING_MPS)
        yield [f"who = yield from look_for({', '.join(words)}, {pace:g})", "if who is None:", "    return"], "who"

    def _before_junction(self, target: Target) -> bool:
        """True if something lies before the next junction, or behind us."""
        ahead = ground(Reference("junction"), self._seen).fits
        return target.kind == "agent" and bool(ahead) and target.forward_m < ahead[0].forward_m

    def _matters(self, target: Target, reference: Reference, *, parked: bool) -> bool:
        """Of a plural: whether this one is ahead and may come in the way; parked ones too where they are passed."""
        if reference.kind not in PLURALS:
            return True
        agent = next((one for one in self._seen.others if one.id == target.agent), None)
        stays = agent is not None and "parked" in states_of(agent, self._seen)
        return agent is not None and target.forward_m > 0.0 and (parked or not stays)

    def _agent(self, reference: Reference) -> VehicleState | None:
        targets = self._referents.get(reference)
        if targets is None or not targets.targets or targets.targets[0].kind != "agent":
            return None
        number = targets.targets[0].agent
        return next((one for one in (*self._seen.others, *self._seen.objects) if one.id == number), None)

    def _in_our_way(self, reference: Reference) -> bool:
        """True if a road user stands or drives in our own lane."""
        agent, road = self._agent(reference), self._seen.road
        own = road.get(self._seen.ego.lane)
        if agent is None or own is None or agent.kind == "pedestrian":
            return False
        lane = road.get(agent.lane)
        if lane is None or lane.id not in {one.id for one, _ in zip(road.ahead(own.id), range(6), strict=False)}:
            return False
        return abs(lane.centre.project(agent.x_m, agent.y_m)[1]) < max(AT_KERB_M, _WIDTH_M)

    def _beside_us(self, reference: Reference) -> bool:
        targets = self._referents.get(reference)
        return targets is not None and bool(targets.targets) and targets.targets[0].away_m < 12.0

    @property
    def _limit_mps(self) -> float:
        return self._situation.speed_limit_mps

    @property
    def _light_ahead(self) -> bool:
        return bool(ground(Reference("light"), self._seen).fits)

    # Words ------------------------------------------------------------------------------------------------------------

    def _told(self, act: Act) -> str:
        words = act_words(act).replace(" — ", ", ")
        named = [reference for reference in references_of(act) if reference in self._referents]
        seen = [found.targets[0] for reference in named if (found := self._referents[reference]).targets]
        where = [f"the {one.words} {_place(one)}" for one in seen if one.kind == "agent"]
        later = [reference_words(reference) for reference in named if not self._referents[reference].targets]
        notes = [f"I mean {' and '.join(where)}"] if where else []
        notes += [f"I look out for {' and '.join(later)} on the way"] if later else []
        return words[:1].upper() + words[1:] + (f" ({'; '.join(notes)})" if notes else "")


def references_of(act: Act) -> tuple[Reference, ...]:
    """All references of an act."""
    held = (act.target, None if act.place is None else act.place.ref, None if act.when is None else act.when.ref)
    return tuple(one for one in held if one is not None)


def _place(target: Target) -> str:
    side = " on the left" if target.leftward_m > 1.5 else " on the right" if target.leftward_m < -1.5 else ""
    if target.forward_m < 0.0:
        return f"{target.away_m:.0f} m behind us{side}"
    return f"{target.away_m:.0f} m ahead{side}"


def _tag(act: Act) -> str:
    if act.negated:
        return "keep"
    name = _TAGS.get(act.act, act.act)
    return f"{name}.{act.side}" if act.side and act.act in ("turn", "lane") else name
