"""Claims about what something waits for or depends on, and about what is left as it is."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from chauffeur.safety.alignment import wording as words
from chauffeur.safety.alignment.amounts import speeds, waits
from chauffeur.safety.alignment.claim import Claim, clause_quantities
from chauffeur.safety.alignment.clauses import Clause
from chauffeur.safety.alignment.motions import motions, sides_of


def looks(clause: Clause) -> bool:
    """Whether a clause speaks of looking if a way is free."""
    said = set(clause.words)
    if said & {"skip", "skips", "skipping", "omit"}:
        return False
    if said & {"wait", "let", "lets", "allow"} and said & {"traffic", "everyone", "everybody", "others"}:
        return True
    if clause.says("is safe enter", "give way", "gives way", "yield to", "yields to", "yielding to"):
        return True
    if clause.says(
        "safe gap", "safe opening", "safe moment", "when safe", "if safe", "until safe", "safe to enter", "way is clear"
    ):
        return True
    ways = {"lane", "lanes", "traffic", "gap", "crossing", "cross", "vehicles", "cars", "rear", "car", "check", "it",
            "them", "directions", "ways", "side"}  # fmt: skip
    if said & words.LOOKS and said & words.SAFE and not said & {"limit"}:
        return True
    strong = words.LOOKS - {"make", "ensure", "ensures", "ask", "asks", "look", "looks", "looking"}
    return (bool(said & strong) and bool(said & ways)) or clause.says("look both ways", "look for a", "sufficient gap")


def conditions(clause: Clause, base: Claim, *, crossing: bool) -> Iterator[Claim]:
    """What a clause claims that something waits for or depends on."""
    said = set(clause.words)
    sides = sides_of(clause)
    denied = clause.negated
    ways = {"lane", "it", "way", "gap", "nobody", "that", "both", "traffic", "them", "room", "junction", "they", "all",
            "crossing", "lanes", "road", "one", "opening", "moment", "clear", "safe", "side"}  # fmt: skip
    safe = said & {"safe", "clear", "clears", "free", "vacant", "safely"} and (said & ways)
    nobody = clause.says("nobody", "no one", "no traffic", "none comes", "gap is available", "gap opens", "opens up",
                         "room", "gap in", "sufficient gap", "safe gap", "traffic has gone")  # fmt: skip
    nobody = nobody and not (said & {"front", "ahead"} and not said & {"lane", "side", "left", "right"})
    roomy = "enough" in said and said & {"space", "room"}
    looked = said & words.LOOKS and said & {"safety", "safe", "clear", "free", "traffic", "lane"}
    if (safe or nobody or roomy or looked) and not clause.says("not safe", "is not free", "not clear"):
        yield replace(base, matter="check", sides=sides, denied=False)
    numbers = clause_quantities(clause)
    other = bool(said & (words.VEHICLES | {"it", "lead's"}))
    ours = bool(said & {"we", "i", "our", "us"})
    said_speeds = tuple(q for q in clause_quantities(clause, "speed") if q.dimension == "speed")
    than = said & {"slower", "faster", "below", "above", "exceeds", "under"} or (
        said & {"less", "more"} and said_speeds
    )
    if other and not ours and than:
        yield replace(base, matter="other speed", quantities=said_speeds, denied=denied)
    elif not ours and said & {"behind", "rear"} and any(q.dimension == "distance" for q in numbers):
        yield replace(
            base, matter="behind", quantities=tuple(q for q in numbers if q.dimension == "distance"), denied=denied
        )
    elif any(q.dimension == "distance" for q in numbers):
        yield replace(
            base, matter="other gap", quantities=tuple(q for q in numbers if q.dimension == "distance"), denied=denied
        )
    elif other and not ours and said & {"closer", "nearer", "farther", "further"}:
        yield replace(base, matter="other gap", denied=denied)
    yield from waits(clause, base)
    done = clause.opener in ("after", "once", "when", "as soon as", "before", "until", "while")
    if done and not denied:
        yield from (
            replace(claim, firm=clause.opener in ("after", "before", "once"))
            for claim in motions(clause, base, sides, crossing=crossing, checking=False)
            if claim.matter != "lane" or sides
        )
        if not other or ours:
            yield from (replace(claim, firm=clause.opener == "after") for claim in speeds(clause, base))


def stays(clause: Clause, base: Claim) -> Iterator[Claim]:
    """What is said to be left as it is."""
    said = set(clause.words)
    if clause.mood != "plan":
        return
    if clause.says("same speed as", "same lane as"):
        return
    keeps = said & (words.KEEPS | words.UNCHANGED)
    if keeps and (
        "lane" in said or clause.says("stay behind", "remain behind", "remains behind", "stays behind", "where we are")
    ):
        yield replace(base, matter="stay", sides=frozenset({-1, 1}), denied=False)
    if keeps and said & words.SPEEDS and said & {"present", "current", "our", "same"} and not clause_quantities(clause):
        yield replace(base, matter="nothing", denied=False, sides=frozenset({2}))
    nothing = clause.says(
        "nothing", "do nothing", "no action", "no change", "no manoeuvre", "no lane change", "no lane changes",
        "as it is", "the way it is", "unchanged", "untouched", "same speed", "same lane", "not change",
        "nothing has to change",         "no speed change", "left alone", "leave the target speed",
    )  # fmt: skip
    if said & words.KEEPS and said & words.GAPS and said & {"default", "usual", "same"}:
        yield replace(base, matter="nothing", denied=False, quantities=(), sides=frozenset({3}))
        return
    if nothing and not any(q.dimension == "time" for q in clause_quantities(clause)):
        yield replace(base, matter="nothing", denied=False, quantities=(), sides=_about(said))


def _about(said: set[str]) -> frozenset[int]:
    """What is said to stay: 1 the lane, 2 the speed, 3 the gap; nothing for all of it."""
    found: set[int] = set()
    if said & {"lane", "lanes"}:
        found.add(1)
    if said & words.SPEEDS:
        found.add(2)
    if said & {"headway", "gap", "distance"}:
        found.add(3)
    return frozenset(found)
