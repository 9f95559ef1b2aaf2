"""Words by which a text about driving is understood: what is done, who does it, and how sure the text is of it.

They are ordinary English, collected by part of speech, not taken from any generator's templates.
"""

from __future__ import annotations

from typing import Final


def listed(text: str) -> frozenset[str]:
    """The words of a text as a set."""
    return frozenset(text.split())


def phrases(text: str) -> tuple[tuple[str, ...], ...]:
    """Phrases that a slash parts, each as its words."""
    return tuple(tuple(line.split()) for line in text.strip().split("/"))


PERSONS: Final = listed(
    "you your passenger passengers user users rider riders customer instruction request command driver person guest "
    "they he she somebody someone passenger's task order human"
)
"""Who wishes; a clause about them tells a wish, not a plan."""

WISHING: Final = listed(
    "want wants wanted wish wishes wished ask asks asked requested requests demands demanded desired likes "
    "prefers preferred complains complained feels dislikes afraid scared hurry late sick nervous uneasy"
)

VEHICLES: Final = listed(
    "car cars vehicle vehicles truck trucks lorry van bus lead leader traffic one guy somebody someone queue driver"
)
"""Others on the road."""

OURSELVES: Final = listed("i we us our my me let lets program plan policy ego code it")

COULD: Final = listed("could would might")
"""What is only thought of."""

NEGATIONS: Final = listed("not no never without neither nor none nobody nothing avoid avoids avoiding refrain cannot")

CONDITIONS: Final = phrases(
    "if/when/whenever/once/as soon as/until/till/unless/provided that/provided/as long as/only when/only if/only while/"
    "in case/so long as/the moment/upon/should it/should the/after/while"
)
"""What begins a clause that something depends on."""

REASONS: Final = phrases(
    "because/since/although/though/even if/even though/so that/otherwise we/in order to/as the/as it/as this/as we/"
    "rather than/instead of/which/such that/due to/to be sure/as there/as right hand/as safety"
)
"""What begins a clause that gives a reason, or something that is not done."""

BREAKS: Final = phrases(
    "after that/after this/and then/then/and/but/so/thus/hence/therefore/afterwards/before/or else/or/else/"
    "subsequently/finally/after which/next/later/first/firstly/secondly/where"
)
"""What begins another clause of the same kind."""

NOW: Final = listed("currently now present presently moment already default normally usually today known reported")
"""Words of a state."""

MOVES: Final = listed(
    "change changes changing changed switch switches switching switched move moves moving moved shift shifts "
    "shifting shifted go goes going merge merges merging slip slips slipping pull pulls pulling head heads "
    "heading steer steers get gets getting drift dodge dodges swerve swerves transition enter enters entering "
    "entered take takes taking use uses using choose chooses choosing select selects selecting set sets setting "
    "target make makes making come comes over work cut cuts jump hop hops leave leaves cross bring brings put "
    "puts"
)
"""Verbs that bring a car to another lane, or over a junction."""

LOOKS: Final = listed(
    "check checks checking checked look looks looking watch watches watching examine examines verify verifies "
    "verified verifying inspect observe monitor peek peeks glance glances scan scans survey poll polls make "
    "ensure ensures ensuring confirm confirms confirming ask asks"
)

SAFE: Final = listed("safe safely clear clears cleared free frees vacant empty opens opening enough sufficient nobody")

TURNS: Final = listed(
    "turn turns turning go goes going take takes taking make makes making choose chooses select selecting "
    "selects route head continue proceed cross crossing drive across pick branch carry"
)

UP: Final = listed(
    "faster accelerate accelerates accelerating acceleration quicker hurry hurrying speeding sportier livelier brisker"
)
DOWN: Final = listed(
    "slower slow slows slowing decelerate decelerates decelerating brake brakes braking subtract calmer deceleration"
)
RAISE: Final = listed(
    "increase increases increasing raise raises raising raised higher more lift up gain boost pick add extra "
    "additional increased greater picks gains"
)
LOWER: Final = listed(
    "reduce reduces reducing reduced lower lowers lowering lowered decrease decreases decreasing drop drops "
    "dropping less cut cuts reduction down ease eases easing gentler off dropped brings"
)
SPEEDS: Final = listed("speed velocity pace tempo speeds")
GAPS: Final = listed("gap headway distance room space following spacing separation gaps")
WIDER: Final = listed(
    "increase increases increasing raise raises raised more larger bigger longer wider doubled double doubles "
    "grow grows extend extends extending lengthen lengthens open opens widen widens widening roomier extra "
    "greater enlarge enlarges increased"
)
CLOSER: Final = listed(
    "closer halved halve halves tighten tightens tightening shorten shortens shortening reduce reduces reducing "
    "close closes closing smaller shorter less decrease decreases decreasing tighter"
)
OVERTAKES: Final = listed("overtake overtakes overtaking overtaken overtook undertake undertaking")
PASSES: Final = listed("pass passes passing passed")
STOPS: Final = listed(
    "stop stops stopping halt halts halting pause pauses pausing standstill stationary stopped halted standing "
    "stand stands"
)
JUNCTIONS: Final = listed("intersection junction crossing crossroads crossroad sign")
KEEPS: Final = listed("stay stays staying remain remains remaining keep keeps keeping hold holds holding maintain pin")
UNCHANGED: Final = listed("unchanged untouched same alone")
FIRST: Final = listed("first firstly initially")
LATER: Final = listed("then next afterwards finally later subsequently after secondly thereafter")
