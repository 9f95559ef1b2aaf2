"""Several meanings of one wish made into steps: reason and wish, means and end, part and whole."""

from __future__ import annotations

from dataclasses import replace

from chauffeur.planners.onboard.meaning import BIT, Manoeuvre, Meaning, NotUnderstood

_MANNERS = {"hurry": "swift", "comfort": "gentle", "careful": "gentle", "relax": "gentle"}
_ENDS_OF_SLOWING: frozenset[Manoeuvre] = frozenset({"turn", "stop", "pull_over", "yield", "follow"})


def fuse(found: list[Meaning], hard: list[bool]) -> list[Meaning] | NotUnderstood:
    """Steps in order, or why they do not fit together.

    Args:
        found: Meanings in the order they are to be done.
        hard: For each, whether the wish says that it comes after the one before ("then").
    """
    steps = list(zip(found, hard, strict=True))
    steps = _without_reasons(steps)
    steps = _without_exclusions(steps)
    if not steps:
        side = next((m.direction for m in found if m.variant == "not"), None)
        other = "right" if side == "left" else "left"
        return NotUnderstood("ambiguous", f"Not {side}, then. Shall I go straight on or {other}?")
    out: list[tuple[Meaning, bool]] = []
    for meaning, later in steps:
        if not out:
            out.append((meaning, later))
            continue
        last, since = out[-1]
        joined = _join(last, meaning, later=later)
        if isinstance(joined, NotUnderstood):
            return joined
        if joined is None:
            out.append((meaning, later))
        else:
            out[-1] = (joined, since)
    return [meaning for meaning, _ in out]


def _without_reasons(steps: list[tuple[Meaning, bool]]) -> list[tuple[Meaning, bool]]:
    """A feeling beside a plain wish is its reason; what leaves things as they are gives way to what changes them."""
    firm = [
        s for s in steps if s[0].manoeuvre not in ("style", "keep", "resume") and s[0].variant not in ("hint", "not")
    ]
    if firm:
        manner = next((_MANNERS[m.variant] for m, _ in steps if m.variant in _MANNERS), "")
        kept = [s for s in steps if s in firm or s[0].variant == "not" or (s[1] and s[0].manoeuvre == "style")]
        return [(replace(m, manner=m.manner or manner), later) for m, later in kept]
    changing = [s for s in steps if s[0].manoeuvre not in ("keep", "resume")]
    hinted = [s for s in changing if s[0].variant == "hint"]
    return hinted[:1] or changing or steps[:1]


def _without_exclusions(steps: list[tuple[Meaning, bool]]) -> list[tuple[Meaning, bool]]:
    """ "Not left, right": the excluded side falls away; "don't change lanes, just slow down": so does the held lane."""
    steps = [s for s in steps if s[0].variant != "not"]
    if any(m.manoeuvre not in ("speed", "gap") for m, _ in steps):
        steps = [s for s in steps if s[0].variant != "bounded"]  # "without speeding, get past him"
    active = [s for s in steps if s[0].variant not in ("hold", "no overtaking")]
    held = {m.manoeuvre for m, _ in active}
    if not active:
        return steps[:1]
    return [s for s in steps if s in active or (s[0].variant == "no overtaking" and "overtake" in held)]


def _join(a: Meaning, b: Meaning, *, later: bool) -> Meaning | NotUnderstood | None:
    """One meaning out of two neighbours; None when they stay two steps."""
    kinds = {a.manoeuvre, b.manoeuvre}
    if a.manoeuvre == b.manoeuvre:
        return _same(a, b, later=later)
    if kinds == {"lane", "overtake"}:
        return _lane_and_overtake(a, b, later=later)
    if "pull_over" in kinds and kinds & {"stop", "lane"} and not (later and b.manoeuvre == "lane"):
        return _into(a, b, "pull_over")
    if kinds == {"pull_over", "speed"} and not (later and b.manoeuvre == "speed"):
        return _into(a, b, "pull_over")
    if kinds == {"stop", "turn"}:
        return _into(a, b, "turn")  # every way over the junction begins with its stop sign
    if kinds == {"lane", "turn"} and (a.direction == b.direction or "junction" in a.condition):
        return _into(a, b, "turn")
    if kinds == {"speed", "gap"} and not (a.amount and b.amount):
        return _means(a, b)
    if "speed" in kinds and kinds & _ENDS_OF_SLOWING and not later:
        speed, end = (a, b) if a.manoeuvre == "speed" else (b, a)
        if speed.change < 0 and speed.amount is None:
            return _into(a, b, end.manoeuvre)
    if kinds == {"speed", "overtake"} and a.manoeuvre == "speed" and a.change > 0 and a.amount is None and not later:
        return replace(_into(a, b, "overtake"), manner="swift")
    if kinds == {"yield", "gap"}:
        return _into(a, b, "yield")
    if kinds == {"follow", "gap"}:
        return _into(a, b, "gap")
    if kinds == {"follow", "speed"} and not later:
        return _into(a, b, "speed")
    if kinds == {"follow", "overtake"}:
        return NotUnderstood("ambiguous", "Overtake or stay behind? Please tell me one of the two.")
    return None


def _same(a: Meaning, b: Meaning, *, later: bool) -> Meaning | NotUnderstood | None:
    if a.change * b.change < 0:
        if later:
            return None
        if b.variant == "bounded":  # "faster, but not too fast"
            return replace(a, degree=BIT, evidence=a.evidence + b.evidence)
        pair = ("faster or slower", "speed") if a.manoeuvre == "speed" else ("closer or further back", "gap")
        return NotUnderstood("ambiguous", f"I heard two opposite wishes. Do you want {pair[0]}?")
    if a.manoeuvre in ("lane", "turn", "overtake") and a.direction and b.direction and a.direction != b.direction:
        if later:
            return None
        return NotUnderstood("ambiguous", f"I heard both {a.direction} and {b.direction}. Which one do you want?")
    if later and a.amount is not None and b.amount is not None and a.amount != b.amount:
        return None
    if a.manoeuvre == "lane" and later and a.direction == b.direction and a.direction is not None:
        return None
    if a.manoeuvre == "style" and a.variant != b.variant:
        return a
    return replace(
        a,
        direction=a.direction or b.direction,
        change=a.change or b.change,
        amount=a.amount or b.amount,
        variant=a.variant or b.variant,
        degree=b.degree if a.degree == Meaning("keep").degree else a.degree,
        manner=a.manner or b.manner,
        condition=a.condition or b.condition,
        loose=a.loose and b.loose,
        evidence=a.evidence + b.evidence,
        score=a.score + b.score,
    )


def _lane_and_overtake(a: Meaning, b: Meaning, *, later: bool) -> Meaning | NotUnderstood | None:
    """A lane named before the overtaking is the way past; one named after it is the way back, if it differs."""
    overtake, lane = (a, b) if a.manoeuvre == "overtake" else (b, a)
    if lane.variant == "home":
        return replace(_into(a, b, "overtake"), variant="return")
    if overtake is a and (later or lane.variant == "return") and lane.direction != a.direction:
        return None
    if overtake.direction is not None and lane.direction not in (None, overtake.direction):
        return None if later else NotUnderstood("ambiguous", "Left or right: on which side shall I overtake?")
    merged = _into(a, b, "overtake")
    variant = overtake.variant if overtake.variant != "hint" else ""
    return replace(merged, direction=overtake.direction or lane.direction, variant=variant)


def _means(a: Meaning, b: Meaning) -> Meaning | None:
    """ "Slow down and leave more room" asks for room; "reduce your speed to 20, then close up" for both."""
    speed, gap = (a, b) if a.manoeuvre == "speed" else (b, a)
    if speed.amount is not None or speed.variant:
        return None
    wanted = -gap.change if gap.amount is None or gap.amount.frame != "absolute" else speed.change
    return _into(a, b, "gap") if speed.change == wanted else None


def _into(a: Meaning, b: Meaning, manoeuvre: Manoeuvre) -> Meaning:
    kept, gone = (a, b) if a.manoeuvre == manoeuvre else (b, a)
    return replace(
        kept,
        manner=kept.manner or gone.manner,
        condition=kept.condition or gone.condition,
        evidence=a.evidence + b.evidence,
        score=a.score + b.score,
    )
