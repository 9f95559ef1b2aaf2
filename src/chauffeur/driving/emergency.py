"""What the car does about emergency words: the plans are fixed, and no model decides.

Words that are read as such ask no planner. What a planner then understands as a call to stop or as distress gets the
same answer as if it had been said in so many words: it marks its plan (`Plan.alarm`), and a language model, which
marks nothing, is taken at its own stop and its own words.

The minimal-risk manoeuvre keeps the lane and brakes evenly, at no more than 4 m/s2 unless the lead vehicle asks for
more, with hazard lights on (UN Regulation No. 157, 5.5). A simulated car has no lamps: that they are on is said in
words.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from chauffeur.concept import Alarm, Observation, Parameters, Plan, Program, Thoughts, Verdict
from chauffeur.control import LAMPILOT_EGO
from chauffeur.driving.fallback import MINIMAL_RISK_BRAKING_MPS2
from chauffeur.language.emergency import SAFE_STOP_WISH, Emergency, read_emergency, tells_of_alarm
from chauffeur.language.languages.reader import help_question
from chauffeur.safety.bounds import least_speed_mps, shoulder_at_right
from chauffeur.safety.constant_calls import read_program

EMERGENCY_CHECK: Final = "emergency-v1"
EMERGENCY_PLANNER: Final = "emergency"

STOPPING: Final = "Stopping. Hazard lights are on; the car keeps its lane and brakes to a stand."
GOING_ON: Final = "I do not stop. The car goes on as it was."
NO_SHOULDER: Final = "There is no shoulder here. To stop in this lane at once, say: “Stop!”"
QUESTION: Final = "Shall I stop at the next safe place?"
ASKED: Final = f"I cannot call anybody. {QUESTION} If so, say: “{SAFE_STOP_WISH}” To stop at once, say: “Stop!”"
"""The question where nobody waits for a yes."""

ALARM_WORDS: Final[dict[Alarm, str]] = {"stop": "Stop the car!", "distress": "This is an emergency."}
"""What an alarm stands for, in words that are always read as `stop` and `ask`."""

_STOPPED_MPS: Final = 0.1
_SHOULDER_BRAKING_MPS2: Final = 3.0
"""On the shoulder there is time."""
_SLACK_MPS: Final = 0.5
_LAW_MPS2: Final[dict[str, float]] = {"highway": 30.0, "intersection": 30.0}
"""Factor a of LaMPilot's law on a free road, a (1 - (v / v0)^4) m/s2, cut at 5 (control/actuation.py)."""
_USUAL_LAW_MPS2: Final = LAMPILOT_EGO.acceleration_mps2
"""The same of other worlds (`worlds/over_graph.py`)."""
_EASY: Final = frozenset({"parking", "town"})
"""Kinds of road whose drivers brake by 3 m/s2 at most towards a lower target, and by less towards a near one."""
_EASY_MPS2: Final = 3.0
_STOPPING_INTENTS: Final = frozenset({"stop", "pull_over", "park"})

_STOP_PROGRAM: Final = """def minimal_risk_manoeuvre():
    # Hazard lights on; keep the lane, and brake with an even {braking:g} m/s2 to a stand.
    ego = get_ego_vehicle()
    say("Hazard lights on. I stop in this lane.")
    set_target_lane(get_lane_of(ego))
    set_desired_time_headway(2.0)
    while get_speed_of(ego) > 0.5:
        set_target_speed({slower})
        yield autopilot()
    set_target_speed(0.0)
    yield autopilot()
"""
_SAFE_STOP_PROGRAM: Final = """def stop_on_the_shoulder():
    # Hazard lights on; lane by lane to the shoulder, which has none to its right, and an even 3 m/s2 to a stand there.
    ego = get_ego_vehicle()
    say("Hazard lights on. I stop on the shoulder.")
    set_desired_time_headway(2.0)
    cruise = 0.9 * get_speed_of(ego)
    right = get_right_lane(ego)
    while right is not None:
        waited = 0
        while not is_safe_enter(right):
            # Traffic beside is let by: a tenth slower every 5 s, no less than 0.7 of what it was.
            set_target_speed(max(0.75, 1.0 - 0.002 * waited) * cruise)
            waited = waited + 1
            yield autopilot()
        set_target_lane(right)
        while get_lane_of(ego) != right:
            yield autopilot()
        right = get_right_lane(ego)
    while get_speed_of(ego) > 0.5:
        set_target_speed({slower})
        yield autopilot()
    set_target_speed(0.0)
    yield autopilot()
"""
_GO_ON_PROGRAM: Final = """def go_on():
    # No stop: speed and lane as they are, and no slower than traffic allows for.
    set_target_speed({speed:.2f})
    while True:
        yield autopilot()
"""


def planned_for(text: str, observation: Observation) -> Plan | None:
    """The plan for emergency words; None where the words are a planner's business.

    Args:
        text: What the person says.
        observation: The instant.
    """
    found = read_emergency(text)
    if found is None or not found.alone:
        return None
    kind = observation.kind
    braking = _EASY_MPS2 if kind in _EASY else MINIMAL_RISK_BRAKING_MPS2
    stop = _STOP_PROGRAM.format(braking=braking, slower=_slower(kind, braking))
    match found.kind:
        case "stop":
            return _plan(STOPPING, stop, "stop", 0.0)
        case "safe_stop" if shoulder_at_right(observation):
            return _plan(
                "Hazard lights on: I make for the shoulder and stop there.",
                _SAFE_STOP_PROGRAM.format(slower=_slower(kind, _SHOULDER_BRAKING_MPS2)),
                "pull_over",
                0.0,
            )
        case "safe_stop":
            return _plan(f"There is no shoulder here. {STOPPING}", stop, "stop", 0.0)
        case "ask":
            return Plan(
                Thoughts(f"“{found.words}”: {question_to(found)}"),
                None,
                ASKED if found.language is None else question_to(found),
                intent="ask",
                planner=EMERGENCY_PLANNER,
                offer=SAFE_STOP_WISH,
            )
        case "no_stop":
            speed = round(max(observation.ego.speed_mps, least_speed_mps(observation) or 0.0), 2)
            return _plan(GOING_ON, _GO_ON_PROGRAM.format(speed=speed), "speed.keep", speed)


def _slower(kind: str, braking_mps2: float) -> str:
    """Expression of the target speed by which the driver on a kind of road brakes evenly."""
    law = _LAW_MPS2.get(kind, _USUAL_LAW_MPS2)
    return "0.0" if kind in _EASY else f"get_speed_of(ego) / (1.0 + {braking_mps2:g} / {law:g}) ** 0.25"


def question_to(found: Emergency) -> str:
    """The question to a person in distress, in their language."""
    return QUESTION if found.language is None else help_question(found.language)


def _plan(thoughts: str, source: str, intent: str, speed_mps: float) -> Plan:
    settings = (("target_speed_mps", speed_mps),)
    return Plan(Thoughts(thoughts), Program(source), intent=intent, settings=settings, planner=EMERGENCY_PLANNER)


def forbids_stop(text: str) -> bool:
    """Whether words forbid stopping, braking or pulling over."""
    found = read_emergency(text)
    return found is not None and found.kind == "no_stop"


def alarm_of(plan: Plan, text: str) -> Alarm:
    """What a planner understood as an alarm: its mark, or what a model that declines says of the person.

    Args:
        plan: The planner's.
        text: What the person said; a person who forbids a stop is not stopped.
    """
    if forbids_stop(text):
        return ""
    declines = plan.policy is None and plan.intent == "declined"
    told = declines and tells_of_alarm(f"{plan.thoughts.text} . {plan.refusal}")
    return plan.alarm or ("distress" if told else "")


def is_bare_stop(plan: Plan, text: str) -> bool:
    """Whether a plan does nothing but stop, at once and in its lane, as far as can be read of it, and may.

    Args:
        plan: The planner's.
        text: As of `alarm_of`.
    """
    if forbids_stop(text):
        return False
    match plan.policy:
        case Parameters(target_speed_mps=speed, lane=0, route=""):
            return 0.0 <= speed <= _STOPPED_MPS
        case Program(source=source):
            uses = read_program(source).uses
            speeds = [use.values for use in uses if use.name == "set_target_speed"]
            still = bool(speeds) and all(
                values and 0.0 <= min(values) <= max(values) <= _STOPPED_MPS for values in speeds
            )
            return still and not any("lane" in use.name and use.name.startswith("set") for use in uses)
        case _:
            return False


def raised(alarm: Alarm, answer: Plan, text: str) -> Plan:
    """The car's own answer to an alarm that a planner understood, marked and told as such."""
    taken = "I take “{}” for a call to stop." if alarm == "stop" else "“{}” may be a call for help, or to stop."
    return replace(answer, thoughts=Thoughts(f"{taken.format(text)} {answer.thoughts.text}"), alarm=alarm)


def not_checked(plan: Plan) -> tuple[Verdict, ...]:
    """What stands in the place of the checks: a manoeuvre of the car's own is not put to them, and is told as such."""
    reason = f"It is the car's own answer to an emergency word: {plan.intent}."
    return (Verdict(EMERGENCY_CHECK, True, reason, not_compared="own-manoeuvre"),)


def check_told_not_to(text: str, plan: Plan, observation: Observation) -> tuple[Verdict, ...]:
    """A verdict on every plan for words that forbid stopping, braking or pulling over; nothing for other words."""
    found = read_emergency(text)
    if found is None or found.kind != "no_stop" or plan.policy is None:
        return ()
    if brings_to_a_stand(plan) or (found.slower and _slows(plan, observation)):
        reason = f"You said “{found.words}”, and this plan would do it: it is not driven. {GOING_ON}"
        return (Verdict(EMERGENCY_CHECK, False, reason, None, "Say what the car is to do instead."),)
    return (Verdict(EMERGENCY_CHECK, True, f"As you said: “{found.words}”."),)


def brings_to_a_stand(plan: Plan) -> bool:
    """Whether a plan brings the car to a stand, by what it says of itself or by what can be read of it."""
    if any(part.partition(".")[0] in _STOPPING_INTENTS for part in plan.intent.split("+")):
        return True
    return any(speed <= _STOPPED_MPS for speed in _speeds(plan))


def _slows(plan: Plan, observation: Observation) -> bool:
    return any(speed < observation.ego.speed_mps - _SLACK_MPS for speed in _speeds(plan))


def _speeds(plan: Plan) -> list[float]:
    speeds = [value for name, value in plan.settings if name == "target_speed_mps"]
    match plan.policy:
        case Parameters(target_speed_mps=speed):
            speeds.append(speed)
        case Program(source=source):
            uses = read_program(source).uses
            speeds += [value for use in uses if use.name == "set_target_speed" for value in use.values]
        case _:
            pass
    return speeds


def stop_wanted(found: Emergency | None) -> bool:
    """Whether the minimal-risk manoeuvre is to begin at once."""
    return found is not None and found.kind == "stop"
