"""R in words: what was understood, where we are, what the program does, and what was taken for granted."""

from __future__ import annotations

from collections.abc import Sequence

from chauffeur.concept import Situation
from chauffeur.planners.onboard.choose import Choice
from chauffeur.planners.onboard.exemplars.library import number
from chauffeur.planners.onboard.meaning import Meaning
from chauffeur.planners.onboard.personal import Leaning


def thoughts_of(
    meanings: Sequence[Meaning], choice: Choice, situation: Situation, used: Sequence[Leaning], *, does: str = ""
) -> str:
    """R for what was settled. The numbers are those of the policy, written the same way.

    Args:
        meanings: What was understood.
        choice: What was settled.
        situation: Where we are.
        used: What the person's history said about it.
        does: What is done, a clause after "I", where that is not what the steps say.
    """
    understood = "; then ".join(_understood(meaning) for meaning in meanings)
    done = does or ". Then I ".join(step.does for step in choice.steps)
    sentences = [f"You want: {understood}.", _situation(situation), f"I {done}."]
    sentences += [sentence for step in choice.steps for sentence in step.assumed]
    sentences += dict.fromkeys(one.because for one in used if one.because)
    return " ".join(sentences)


def _situation(situation: Situation) -> str:
    front = situation.front
    ahead = (
        f"the vehicle ahead is {number(front.distance_m)} m away at {number(front.speed_mps)} m/s"
        if front is not None
        else f"the stop sign is {number(situation.stop_sign_m)} m ahead"
        if situation.stop_sign_m is not None
        else "no vehicle is near ahead"
    )
    now, allowed = number(situation.speed_mps), number(situation.speed_limit_mps)
    return f"We drive {now} m/s where {allowed} m/s are allowed; {ahead}."


_FAMILIES = {
    "speed.increase": "a higher speed",
    "speed.decrease": "a lower speed",
    "speed.hold": "the speed as it is",
    "speed.set": "a speed you named",
    "speed.cap": "a highest speed",
    "speed.floor": "a lowest speed",
    "speed.limit": "a speed by the limit",
    "speed.match": "the speed of the traffic",
    "speed.max": "as much speed as allowed",
    "gap.increase": "more room to the vehicle ahead",
    "gap.decrease": "less room to the vehicle ahead",
    "gap.hold": "the gap as it is",
    "gap.set": "a gap you named",
    "gap.time": "a time gap you named",
    "gap.cap": "a largest gap",
    "gap.floor": "a smallest gap",
    "lane": "another lane",
    "lane.left": "a lane further left",
    "lane.right": "a lane further right",
    "lane.keep": "to stay in this lane",
    "overtake": "to get past the vehicle ahead",
    "overtake.left": "to get past the vehicle ahead on the left",
    "overtake.right": "to get past the vehicle ahead on the right",
    "turn.left": "a left turn",
    "turn.right": "a right turn",
    "turn.straight": "to go straight on",
    "pull_over": "to pull over",
    "stop": "to stop",
    "follow": "to stay behind others",
    "yield": "to let somebody go first",
    "keep": "everything as it is",
    "resume": "to drive on normally",
    "style.hurry": "to get there sooner",
    "style.relax": "an unhurried drive",
    "style.comfort": "a softer drive",
    "style.careful": "a more careful drive",
    "style.sporty": "a livelier drive",
    "style.eco": "an economical drive",
}


def _understood(meaning: Meaning) -> str:
    words = _FAMILIES[meaning.family]
    if meaning.amount is not None and meaning.amount.said:
        return f"{words} ({meaning.amount.said})"
    return words
