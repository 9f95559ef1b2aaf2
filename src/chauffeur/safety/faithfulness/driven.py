"""Comparing what a text says with what happened in a drive.

A drive that was ended early says nothing of what had not happened by then, and traffic holds up what a program wishes:
a claim counts as not done only if nothing of it was seen.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from chauffeur.concept import Mismatch
from chauffeur.safety.faithfulness.claims import LANES, Claim
from chauffeur.safety.faithfulness.comparison import DRIVEN_SPEED_MPS, Comparison, moving, turning
from chauffeur.safety.faithfulness.facts import Effect

_WORTH_MPS: Final = 2.0
"""A speed that is to change by less is not looked for in a drive."""
_WORTH_M: Final = 2.0
"""The same of a gap."""


def driven_mismatches(case: Comparison, effect: Effect) -> Iterator[Mismatch]:
    """Yield mismatches of a text and a drive."""
    claims = [claim for claim in case.claims if claim.firm]
    if case.crossing:
        yield from _turned(claims, effect)
    else:
        yield from _changed_lanes(case, claims, effect)
    for claim in claims:
        if claim.matter == "stop" and claim.denied and effect.stood:
            yield Mismatch("not-claimed", claim.sentence, "it stood still on the way")
        elif effect.cut or claim.denied:
            continue
        elif claim.matter == "stop" and not effect.stood:
            yield Mismatch("not-done", claim.sentence, "it did not come to a stop in this drive")
        elif claim.matter == "speed" and claim.sign:
            yield from _drove(case, claim, effect)
        elif claim.matter == "gap" and claim.sign:
            yield from _followed(claim, effect)


def _changed_lanes(case: Comparison, claims: Sequence[Claim], effect: Effect) -> Iterator[Mismatch]:
    gone = effect.sides
    told = [claim for claim in claims if claim.matter in LANES and not claim.denied]
    if not told:
        stays = [one for one in claims if one.matter in LANES or (one.matter == "stay" and "speed" not in one.about)]
        if gone and (stays or (case.firm and not case.told & LANES)):
            yield Mismatch("not-claimed", stays[0].sentence if stays else "", f"it {moving(gone, driven=True)}")
        return
    named = frozenset(side for claim in case.claims if claim.matter in LANES for side in claim.sides)
    anywhere = any(not claim.sides or claim.matter != "lane" for claim in told)
    missed = next((claim for claim in told if claim.sides and not claim.sides & gone), None)
    if gone and not anywhere and gone - named:
        yield Mismatch("wrong-side", told[0].sentence, f"it {moving(gone - named, driven=True)}")
    elif effect.cut:
        return
    elif not gone:
        yield Mismatch("not-done", told[0].sentence, "it did not change lanes in this drive")
        return
    elif missed is not None:
        yield Mismatch("not-done", missed.sentence, f"in this drive it only {moving(gone, driven=True)}")
    ahead = effect.gaps_m[1]
    passing = next((claim for claim in told if claim.matter == "overtake"), None)
    if passing is not None and ahead is not None and ahead > 0.0 and not effect.cut:
        yield Mismatch("not-done", passing.sentence, "the vehicle ahead was never passed in this drive")


def _turned(claims: Sequence[Claim], effect: Effect) -> Iterator[Mismatch]:
    told = [one for one in claims if one.matter == "turn" and one.sides and not one.denied]
    done = 2 if abs(effect.turned) == 2 else effect.turned
    if len(told) != 1 or done in told[0].sides:
        return  # of several turns, the heading at the end tells none
    if done:
        yield Mismatch("wrong-side", told[0].sentence, f"in this drive it {turning(frozenset({done}), driven=True)}")
    elif not effect.cut:
        yield Mismatch("not-done", told[0].sentence, "it did not come to turn in this drive")


def _drove(case: Comparison, claim: Claim, effect: Effect) -> Iterator[Mismatch]:
    start = effect.speeds_mps[0]
    wanted = case.numbers.speeds_mps()
    if wanted and all(abs(speed - start) < _WORTH_MPS for speed in wanted):
        return
    low, high = effect.extremes_mps
    if claim.sign == 1 and high < start + DRIVEN_SPEED_MPS:
        yield Mismatch("not-done", claim.sentence, f"it was never faster than {high:.1f} m/s in this drive")
    elif claim.sign == -1 and low > start - DRIVEN_SPEED_MPS:
        yield Mismatch("not-done", claim.sentence, f"it was never slower than {low:.1f} m/s in this drive")


def _followed(claim: Claim, effect: Effect) -> Iterator[Mismatch]:
    before, after = effect.gaps_m
    if before is not None and after is not None and after >= 0.0 and claim.sign * (after - before) < -_WORTH_M:
        change = f"the gap went from {before:.0f} m to {after:.0f} m in this drive"
        yield Mismatch("wrong-sign", claim.sentence, change)
