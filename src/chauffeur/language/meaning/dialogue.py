"""Turns that mean something only beside the one before: `pick`, `again` and `undo` become the acts they stand for.

    "Pass the red truck."   "No, the other one."      pass the second red truck
    "Drive at 50 km/h."     "Make it 40."             drive at 40 km/h
    "Turn left."            "The other way."          turn right
    "Slow down."            "A bit more."             slow down a bit
    "Change lanes."         "Back as it was."         change back to the original lane

What the turn before does not tell is `unclear`, and asked about.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Final

from chauffeur.concept.dialogue import ANSWERS, DIALOGUE, wishes
from chauffeur.concept.utterance import Act, ActPlace, Direction, LaneAim, Reference, Side, Utterance, Verb

_ELLIPTICAL: Final[frozenset[Verb]] = frozenset({"again", "undo", "pick"})
_SURE: Final = 0.5
"""A sentence that is less surely a turn of dialogue is left as it was said."""
_OTHER_SIDE: Final[Mapping[Side, Side]] = {"left": "right", "right": "left"}
_OTHER_AIM: Final[Mapping[LaneAim, LaneAim]] = {"leftmost": "rightmost", "rightmost": "leftmost"}
_OPPOSITE: Final[Mapping[Direction, Direction]] = {
    "slower": "faster", "faster": "slower", "more": "less", "less": "more", "same": "same",
}  # fmt: skip
_SIDED: Final[frozenset[Verb]] = frozenset(
    ("turn", "straight", "lane", "keep", "move", "pass", "avoid", "park", "pull_over", "stop", "exit", "enter")
)
"""Verbs of which a side can be chosen, though none was said."""
_REFERRING: Final[frozenset[Verb]] = frozenset({"follow", "pass", "avoid", "yield", "gap", "goto", "enter", "wait"})
"""Verbs that may be given a target, though none was said."""
_AMOUNTS: Final[Mapping[str, Verb]] = {
    "km/h": "speed", "mph": "speed", "m/s": "speed", "m": "gap", "ft": "gap", "yd": "gap", "lengths": "gap",
    "s": "gap", "lanes": "lane",
}  # fmt: skip
"""Quantity that a unit measures, where the turn before does not say otherwise."""
_COUNTED: Final[frozenset[Verb]] = frozenset({"speed", "gap", "lane", "wait"})
_ENDS_WITH_GO: Final[frozenset[Verb]] = frozenset({"stop", "wait", "park", "pull_over"})
_ENDS_WITH_CANCEL: Final[frozenset[Verb]] = frozenset({"follow", "pass", "avoid", "yield", "keep", "goto"})
_UNCLEAR: Final = Act("unclear")


def is_elliptical(turn: Utterance) -> bool:
    """True if words mean something only beside the turn before: no planner can make anything of them alone."""
    return turn.sure >= _SURE and not turn.emergency and any(act.act in _ELLIPTICAL for act in turn.acts)


def resolved(now: Utterance, last: Utterance | None) -> Utterance:
    """Resolve words against the turn before.

    Args:
        now: As it was read by itself.
        last: The turn before that asked for something, resolved; None for the first.

    Returns:
        `now` with acts that stand for themselves. `again` after nothing stays: it is for whoever remembers earlier
        drives. Where acts are left, a "no" before them was about the last turn, and is dropped.
    """
    if not any(act.act in DIALOGUE for act in now.acts):
        return now
    before = () if last is None else wishes(last.acts)
    acts: list[Act] = []
    corrects = True
    """True if nothing but answers was said yet: a choice is about the turn before."""
    for act in now.acts:
        own = () if corrects else wishes(acts)
        match act.act:
            case "again" if own or before:
                acts += _said_at(act, [_merged(one, act) for one in own or before])
            case "undo":
                acts += _said_at(act, _undone(own or before))
            case "pick":
                chosen = _said_at(act, _picked(act, own or before))
                acts = [
                    one for one in acts if one.act in ANSWERS or not _corrected(pick=act, act=one, by=chosen)
                ] + chosen
            case _:
                acts.append(act)
        corrects = corrects and act.act in ANSWERS
    if any(act.act not in ANSWERS for act in acts):
        acts = [act for act in acts if act.act != "no"]
    return replace(now, acts=tuple(acts))


def _corrected(pick: Act, act: Act, by: Sequence[Act]) -> bool:
    """True if an act of the same text is said anew by a choice after it: more of something comes on top of it."""
    if pick.value is not None or pick.aim is not None:
        return any(act.act == one.act for one in by)
    return pick.direction is None


def _said_at(turn: Act, acts: Iterable[Act]) -> list[Act]:
    """Acts of another text, with the words of the turn that stands for them."""
    return [replace(act, span=turn.span) for act in acts]


# A choice ---------------------------------------------------------------------------------------------------------


def _picked(pick: Act, before: tuple[Act, ...]) -> tuple[Act, ...]:
    """The acts that a choice stands for: an amount is changed by itself, and a correction is one of the whole turn."""
    if pick.value is not None or pick.aim is not None:
        return (_amount(pick, before),)
    if pick.direction is not None:
        return (_changed(pick, before),)
    if pick.target is not None or pick.place is not None:
        return _referred(pick, before)
    if pick.side is not None or pick.to is not None:
        return _sided(pick, before)
    last = _last(before)
    if last is None or not (pick.degree or pick.manner or pick.style or pick.when):
        return (_UNCLEAR,)
    return (*before[:-1], _merged(last, pick))


def _last(before: tuple[Act, ...]) -> Act | None:
    return before[-1] if before else None


def _merged(act: Act, said: Act) -> Act:
    """An act with what was said of it now in place of what was said before."""
    fields = ("side", "to", "direction", "manner", "measure", "degree", "aim", "style", "target", "place", "when")
    found = {name: value for name in fields if (value := getattr(said, name)) is not None}
    if said.value is not None:
        found |= {"value": said.value, "unit": said.unit or act.unit}
    return replace(act, **found)


def _amount(pick: Act, before: tuple[Act, ...]) -> Act:
    """The last act that has an amount, with another one."""
    verb = _AMOUNTS.get(pick.unit)
    counted = [act for act in before if act.act in _COUNTED and (verb in (None, act.act) or act.unit == pick.unit)]
    counted = [act for act in counted if act.value is not None or act.act in ("speed", "gap")] or counted
    if not counted:
        plain = {name: getattr(pick, name) for name in ("value", "unit", "measure", "direction", "aim")}
        return _UNCLEAR if verb is None else Act(verb, **plain)
    act = counted[-1]
    measure = pick.measure or (act.measure if pick.value is not None else None)
    change = measure in ("by", "times")
    return replace(
        act,
        value=pick.value,
        unit="" if pick.value is None else pick.unit or act.unit,
        measure=measure,
        direction=pick.direction or (act.direction if change or (act.act == "gap" and act.value is not None) else None),
        aim=pick.aim or (act.aim if measure in ("over_limit", "under_limit") else None),
        degree=None,
        style=None,
        negated=False,
    )


def _changed(pick: Act, before: tuple[Act, ...]) -> Act:
    """More or less of what the last turn asked for, in its direction."""
    act, less = _last(before), pick.direction in ("less", "slower")
    if pick.direction in ("slower", "faster", "same"):
        return Act("speed", direction=pick.direction, degree=pick.degree, manner=pick.manner)
    if act is None:
        return _UNCLEAR
    turned_round = less != act.negated
    match act.act:
        case "speed" | "gap":
            meant = act.direction if act.direction not in (None, "same") else _meant(act)
            direction = _OPPOSITE[meant] if turned_round else meant
            return Act(act.act, direction=direction, degree=pick.degree, manner=act.manner, target=act.target)
        case "lane" | "move" if act.side is not None and act.value is None:
            return replace(act, side=_OTHER_SIDE[act.side] if turned_round else act.side, degree=pick.degree)
        case "wait" if not turned_round:
            return act
        case "go" if act.style in ("hurry", "relaxed", "sporty", "gentle", "careful"):
            brisk = act.style in ("hurry", "sporty")
            return Act("speed", direction="faster" if brisk != turned_round else "slower", degree=pick.degree)
        case _:
            return _UNCLEAR


def _meant(act: Act) -> Direction:
    """Direction of "more" for an act without a direction."""
    slower = act.style in ("relaxed", "gentle", "careful") or act.measure == "under_limit"
    return ("slower" if slower else "faster") if act.act == "speed" else "more"


def _sided(pick: Act, before: tuple[Act, ...]) -> tuple[Act, ...]:
    """The last turn, on the side that is named now."""
    side = _OTHER_SIDE[pick.side] if pick.side is not None and pick.negated else pick.side

    def on(act: Act) -> Act:
        verb = "turn" if act.act == "straight" else act.act
        return replace(act, act=verb, side=side, to=pick.to, negated=False)

    for k in _newest_first(before):
        if before[k].side is not None or before[k].to in _OTHER_AIM:
            return _with(before, k, on(before[k]))
    for k in _newest_first(before):
        if side is not None and (reference := _reference(before[k])) is not None and reference.side is not None:
            return _with(before, k, _pointed(before[k], replace(reference, side=side, deictic=False)))
    for k in _newest_first(before):
        if before[k].act in _SIDED:
            return _with(before, k, on(before[k]))
    return (Act("lane", to=pick.to),) if pick.to is not None else (_UNCLEAR,)


def _referred(pick: Act, before: tuple[Act, ...]) -> tuple[Act, ...]:
    """The last turn, about what is named now."""
    named = pick.target or (None if pick.place is None else pick.place.ref)
    if pick.place is not None and (named is None or named.kind != "other") and before:
        return _with(before, len(before) - 1, replace(before[-1], place=pick.place, negated=False))
    if named is None:
        return (_UNCLEAR,)
    alone = named == Reference("other", deictic=named.deictic)
    if pick.negated and not alone:
        return (_UNCLEAR,)
    other = alone and (pick.negated or not named.deictic)  # "that one" is the one that was meant
    for k in _newest_first(before):
        act = before[k]
        turned = other and act.side is not None and act.target is None
        if (reference := _reference(act)) is not None and not turned:
            if not alone:
                reference = _renamed(reference, named)
            elif other:
                reference = _another(reference)
            elif pick.place is None:  # "beside it" is the same one, and "that one" is pointed at
                reference = replace(reference, deictic=True)
            act = _pointed(act, reference)
            if pick.place is not None:
                act = replace(act, place=ActPlace(pick.place.rel, _reference(act)))
            return _with(before, k, replace(act, side=pick.side or act.side))
    for k in _newest_first(before):
        act = before[k]
        if other and (act.side is not None or act.to in _OTHER_AIM):
            to = None if act.to is None else _OTHER_AIM.get(act.to)
            return _with(before, k, replace(act, side=act.side and _OTHER_SIDE[act.side], to=to))
        if named == Reference("other", side=named.side) and named.side is not None and act.act in _SIDED:
            return _with(before, k, replace(act, side=named.side))
        if named.kind != "other" and act.act in _REFERRING:
            return _with(before, k, replace(act, target=named, negated=False))
    return (_UNCLEAR,)


def _newest_first(before: tuple[Act, ...]) -> range:
    return range(len(before) - 1, -1, -1)


def _with(before: tuple[Act, ...], k: int, act: Act) -> tuple[Act, ...]:
    return (*before[:k], act, *before[k + 1 :])


def _reference(act: Act) -> Reference | None:
    """The first reference of an act: of its target, else its place, else its condition."""
    places = act.place and act.place.ref, act.when and act.when.ref
    return next((one for one in (act.target, *places) if one is not None), None)


def _pointed(act: Act, reference: Reference) -> Act:
    """An act about another reference."""
    if act.target is not None:
        return replace(act, target=reference)
    if act.place is not None and act.place.ref is not None:
        return replace(act, place=replace(act.place, ref=reference))
    return act if act.when is None else replace(act, when=replace(act.when, ref=reference))


def _another(reference: Reference) -> Reference:
    """The other one of the same: the next nearest, and from there the nearest."""
    ordinal = 2 if reference.ordinal in (None, 1) else 1
    if reference.side is not None and reference.ordinal is None:
        return replace(reference, side=_OTHER_SIDE[reference.side], deictic=False)
    return replace(reference, ordinal=ordinal, deictic=False)


def _renamed(reference: Reference, named: Reference) -> Reference:
    """A reference with the attributes that are named now; another kind of thing is another reference."""
    if named.kind not in ("other", reference.kind):
        return named
    said = {
        name: value
        for name in ("colour", "state", "side", "where", "name", "of")
        if (value := getattr(named, name)) not in (None, "")
    }
    return replace(reference, ordinal=named.ordinal, deictic=named.deictic, **said)


# Taking back ------------------------------------------------------------------------------------------------------


def _undone(before: tuple[Act, ...]) -> list[Act]:
    """Acts that take others back, the last of them first."""
    if not before:
        return [_UNCLEAR]
    found: list[Act] = []
    for act in reversed(before):
        inverse = _inverse(act)
        if inverse not in found:
            found.append(inverse)
    return found if all(act.act != "unclear" for act in found) else [_UNCLEAR]


def _inverse(act: Act) -> Act:
    """The act that takes another back."""
    if act.negated and act.act not in DIALOGUE:
        return replace(act, negated=False, when=None)
    match act.act:
        case "lane" if act.to == "original":
            return _UNCLEAR
        case "lane":
            return Act("lane", to="original")
        case "speed" | "gap" if act.direction not in (None, "same"):
            back = Act(act.act, direction=_OPPOSITE[act.direction], target=act.target)
            back = replace(back, style="normal") if act.style else back
            return replace(back, value=act.value, unit=act.unit, measure="by") if act.measure == "by" else back
        case "speed" | "go" if act.act == "speed" or act.style is not None:
            return Act("go", style="normal")
        case "gap":
            return Act("cancel")
        case "move" if act.side is not None:
            return Act("move", side=_OTHER_SIDE[act.side], degree=act.degree)
        case "go":
            return Act("stop")
        case verb if verb in _ENDS_WITH_GO:
            return Act("go")
        case verb if verb in _ENDS_WITH_CANCEL:
            return Act("cancel")
        case _:
            return _UNCLEAR
