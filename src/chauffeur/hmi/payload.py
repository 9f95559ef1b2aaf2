"""A recorded trip as the plain values that the page plays: rounded, in columns, nothing but JSON.

Text stays text here and is set with `textContent` there, so nothing a person or a model wrote is ever markup.
"""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Callable
from typing import Any, cast

from chauffeur.concept import (
    ActionMatrix,
    Frame,
    HistoryItem,
    LaneId,
    Mismatch,
    Observation,
    Parameters,
    Policy,
    Program,
    Trajectory,
    Trip,
    VehicleState,
    Verdict,
)
from chauffeur.concept.paint import css_colour
from chauffeur.concept.results import result_of_stored
from chauffeur.concept.units import MPS_PER_KMH, MPS_PER_MPH, SpeedUnit
from chauffeur.driving.recording import RecordedTrip
from chauffeur.hmi import words
from chauffeur.hmi.events import events_of
from chauffeur.hmi.interventions import stretches_of
from chauffeur.hmi.road import Bounds, PaintedRoad, as_json, draw_road, track_box
from chauffeur.hmi.view import facing_right, frame_drive, instants_of
from chauffeur.hmi.wanted import goal_of, wanted
from chauffeur.safety.faithfulness import KINDS, score_words

_WAYPOINTS_TOLD = 6
_STRAIGHT_M = 0.05
_SIGHT_M = 260.0
"""Nothing farther from the ego's path than this is ever on the screen."""

_FELT = ("_mps", "_m", "_s")
"""Ends of the names of settings that a person feels; gains and indices have none."""
Json = dict[str, Any]


def page_payload(recorded: RecordedTrip) -> Json:
    """Everything the page shows."""
    trip = recorded.trip
    unit = words.pace_of(trip.instruction.text)
    sign, label, tone = words.trip_words(trip)

    def said(text: str) -> str:
        return words.passenger_units(text, unit)

    return {
        "pace": {"unit": unit, "of": 1.0 / (MPS_PER_MPH if unit == "mph" else MPS_PER_KMH)},
        "going_to": goal_of(trip),
        "simulated": words.simulated(recorded.scenario.world),
        "wish": trip.instruction.text,
        "person": trip.instruction.person,
        "title": recorded.scenario.title or recorded.scenario.id,
        "context": trip.context.text,
        "intent": trip.plan.intent,
        "settings": [words.setting(name, value) for name, value in trip.plan.settings],
        "thoughts": said("" if trip.plan.thoughts.text == trip.plan.refusal else trip.plan.thoughts.text),
        "view": "" if recorded.view is None else _data_uri(recorded.view.png()),
        "program": _program_lines(trip.plan.policy),
        "policy": policy_words(trip.plan.policy),
        "verdicts": [_verdict(one, said) for one in trip.verdicts],
        "mismatches": [
            {"kind": KINDS[one.kind], "said": said(one.sentence), "instead": said(one.instead), "line": one.line}
            for one in _mismatches(trip)
        ],
        "shield": _shield(recorded),
        "outcome": {
            "label": label,
            "tone": tone,
            "sign": sign,
            "account": words.account_words(trip),
            "causes": [said(text) for text in words.cause_words(trip.causes) if trip.outcome != "refused"],
            "judged": words.judged_words(trip),
            "end": words.end_words(trip),
        },
        "duration": round(trip.duration_s, 2),
        "metrics": [
            {"id": m.id, "name": words.metric_name(m.id), "value": words.metric_value(m), "applies": m.applies}
            for m in trip.metrics
        ],
        "history": [_history_item(item, unit) for item in trip.history.items],
        "provenance": [list(pair) for pair in provenance(trip)],
        "events": [{"t": round(e.time_s, 2), "kind": e.kind, "label": said(e.label)} for e in events_of(recorded)],
        "drive": _drive(recorded),
    }


def _verdict(verdict: Verdict, said: Callable[[str], str]) -> Json:
    return {
        "name": words.check_name(verdict.check),
        "reason": said(_reason(verdict)),
        "remedy": said(verdict.remedy),
        "sign": words.MARKS[verdict.mark],
        **{name: getattr(verdict, name) for name in ("check", "passed", "line", "vetoes", "mark")},
    }


def _data_uri(png: bytes) -> str:
    return f"data:image/png;base64,{base64.b64encode(png).decode()}"


def provenance(trip: Trip) -> list[tuple[str, str]]:
    """Where a trip comes from, as (name, value): planner, model, seed, hashes, versions, limits."""
    usage = trip.plan.usage
    tokens = usage.prompt_tokens + usage.completion_tokens
    rows = [
        ("planner", trip.plan.planner),
        ("model", trip.plan.model),
        ("planning time", f"{trip.plan.latency_s:.3f} s"),
        ("tokens", f"{usage.prompt_tokens} in, {usage.completion_tokens} out" if tokens else ""),
        ("cost", f"{usage.cost_usd:.4f} USD" if usage.cost_usd is not None else ""),
        ("scenario", trip.scenario),
        ("seed", str(trip.seed)),
        ("trip", trip.id),
    ]
    known = {name for name, _ in rows}
    rows.extend((name.replace("_", " "), _words(value)) for name, value in trip.record if name not in known)
    return [(name, value) for name, value in rows if value]


def policy_words(policy: Policy | None, unit: SpeedUnit | None = None) -> str:
    """P as text, whatever its kind, speeds in the person's unit where one is given; empty when there is none."""
    if policy is None:
        return ""
    if isinstance(policy, Program):
        return policy.text
    if isinstance(policy, Parameters):
        names = ("target_speed_mps", "look_ahead_m", "look_ahead_ratio")
        rows = [words.setting(name, float(getattr(policy, name)), unit) for name in names]
        rows.append(("lane", {-1: "one to the left", 0: "stay", 1: "one to the right"}[policy.lane]))
        if policy.route:
            rows.append(("way", policy.route))
        return "\n".join(f"{label}: {value}" for label, value in rows)
    if isinstance(policy, ActionMatrix):
        pid, mpc = policy.pid, policy.mpc
        return f"Kp {pid[0]:g}  Ki {pid[1]:g}  Kd {pid[2]:g}\nWl {mpc[0]:g}  Wh {mpc[1]:g}  Ws {mpc[2]:g}"
    return _waypoint_words(policy)


def _waypoint_words(policy: Trajectory) -> str:
    """How many waypoints in which time, and some of them, evenly, the last among them."""
    count = len(policy.waypoints_m)
    told = min(count, _WAYPOINTS_TOLD)
    some = [round((i + 1) * count / told) - 1 for i in range(told)]
    lines = [f"{count} waypoints in {count * policy.period_s:.1f} s" + ("; of them" if len(some) < count else "")]
    for place in some:
        x, y = policy.waypoints_m[place]
        aside = "" if abs(y) < _STRAIGHT_M else f", {abs(y):.1f} m to the {'left' if y > 0.0 else 'right'}"
        lines.append(f"{(place + 1) * policy.period_s:.1f} s: {x:.1f} m ahead{aside}")
    return "\n".join(lines)


def program_tokens(source: str) -> list[list[tuple[str, str]]]:
    """Source as lines of (class, text): k keyword, s string, c comment, n number, d definition, a call, or empty."""
    from pygments.lexers.python import PythonLexer
    from pygments.token import Comment, Keyword, Name, Number, Operator, String

    classes = (
        (Comment, "c"),
        (String, "s"),
        (Number, "n"),
        (Keyword, "k"),
        (Operator.Word, "k"),
        (Name.Function, "d"),
    )
    lines: list[list[tuple[str, str]]] = [[]]
    for kind, text in PythonLexer(stripnl=False, ensurenl=False).get_tokens(source):
        name = next((letter for base, letter in classes if kind in base), "")
        if not name and text.startswith("(") and lines[-1] and lines[-1][-1][0] == "i":
            lines[-1][-1] = ("a", lines[-1][-1][1])
        if not name and kind in Name:
            name = "i"
        for index, piece in enumerate(text.split("\n")):
            if index:
                lines.append([])
            if piece:
                lines[-1].append((name, piece))
    return [[("" if name == "i" else name, text) for name, text in line] for line in lines]


def _words(value: Any) -> str:
    """A value of the provenance as a line of text."""
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, dict):
        parts: list[str] = []
        for name, item in cast("Json", value).items():
            if isinstance(item, int | float) and not isinstance(item, bool):
                label, text = words.setting(name, float(item))
                parts.append(f"{label} {text}")
            elif item is not None:
                parts.append(str(item))
        return ", ".join(parts)
    return json.dumps(value, default=str)


def _program_lines(policy: Policy | None) -> list[list[tuple[str, str]]] | None:
    return program_tokens(policy_words(policy).rstrip("\n")) if isinstance(policy, Program) else None


def _reason(verdict: Verdict) -> str:
    """Why; of an explanation that does not fit the single mismatches are shown beside it."""
    if verdict.mark == "not_compared":
        said = words.not_compared_words(verdict)
        return f"{said[:1].upper()}{said[1:]}"
    if verdict.alignment is None or verdict.passed:
        return verdict.reason
    return f"{words.doubt_words(verdict.check)} ({score_words(verdict.alignment)})."


def _mismatches(trip: Trip) -> tuple[Mismatch, ...]:
    """What is wrong in the thoughts; what the drive only showed once more is left out."""
    found: dict[tuple[str, str], Mismatch] = {}
    for verdict in trip.verdicts:
        if verdict.alignment is not None:
            for one in verdict.alignment.mismatches:
                found.setdefault((one.kind, one.sentence), one)
    return tuple(found.values())


def _shield(recorded: RecordedTrip) -> Json | None:
    """What the run-time shield did; None where it did nothing."""
    stretches = stretches_of(recorded.frames)
    if not stretches:
        return None
    return {
        "summary": words.shield_words([change for frame in recorded.frames for change in frame.interventions]),
        "stretches": [
            {
                "t": round(one.start_s, 2),
                "end": round(one.end_s, 2),
                "name": words.rule_words(one.rule),
                "change": words.change_words(one.before, one.after),
                "reason": one.reason,
            }
            for one in stretches
        ],
    }


def _history_item(item: HistoryItem, unit: SpeedUnit) -> Json:
    return {
        "when": item.when,
        "instruction": item.instruction,
        "outcome": str(result_of_stored(item.outcome, item.intent)),
        "settings": [words.setting(name, value, unit) for name, value in item.settings if name.endswith(_FELT)],
        "feedback": [{"text": f.text, "meaning": words.feedback_words(f)} for f in item.feedback],
    }


def _drive(recorded: RecordedTrip) -> Json | None:
    """The moving part: one column per quantity, one entry per instant."""
    seen = instants_of(recorded)
    shots = facing_right(seen)
    if not shots:
        return None
    frames = recorded.frames
    # The instant after the last command has no wishes of its own: it shows the last ones.
    rows: tuple[Frame | None, ...] = frames + (frames[-1:] or (None,)) * (len(shots) - len(frames))
    lanes = shots[0].road.lanes
    limits = {lane.id: lane.speed_limit_mps for lane in lanes}
    camera = frame_drive(shots)
    sight = track_box(tuple((s.ego.x_m, s.ego.y_m) for s in shots)).grown(_SIGHT_M)
    road = draw_road(shots[0].road, shots[0].objects, sight, shots[0].signs)
    return {
        "time": [round(s.time_s, 2) for s in shots],
        "camera": {"along": camera.along, "box": [round(edge, 2) for edge in camera.box.edges]},
        "road": as_json(road),
        "obstacles": [_body(o) for o in shots[0].objects if o.kind == "obstacle"],
        "cones": [_body(o) for o in shots[0].objects if o.kind == "static"],
        "ego": {**_column([s.ego for s in shots]), "first": 0, "l": shots[0].ego.length_m, "w": shots[0].ego.width_m},
        "cars": _cars(shots, sight),
        "lights": _lights(shots, sight),
        **wanted(recorded, sight),
        "speed": [round(s.ego.speed_mps, 2) for s in shots],
        "acceleration": [round(row.applied.acceleration_mps2, 2) if row else 0.0 for row in rows],
        "asked": [round(row.requested.acceleration_mps2, 2) if row else 0.0 for row in rows],
        "target": [_rounded(row.setpoints.target_speed_mps) if row else None for row in rows],
        "limit": [_rounded(limits.get(s.ego.lane) if s.ego.lane else None) for s in shots],
        "gap": [_rounded(s.front.distance_m) if s.front else None for s in shots],
        "lead": [s.front.vehicle if s.front else None for s in shots],
        "stop": [_rounded(s.stop_sign_m) for s in shots],
        "arrives": recorded.trip.outcome == "success",
        "lane": [_lane_words(s) for s in shots],
        "goal": [_goal(row, s, road) for row, s in zip(rows, shots, strict=True)],
        "turn": [row.setpoints.turn if row else None for row in rows],
        "state": [row.program if row else "none" for row in rows],
        "line": [row.line if row else None for row in rows],
        "calls": [[[c.name, c.args, c.result] for c in row.calls] if row else [] for row in rows],
        "said": [[round(f.observation.time_s, 2), text] for f in frames for text in f.said],
    }


def _rounded(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else round(value, 2)


def _body(vehicle: VehicleState) -> Json:
    return {
        "id": vehicle.id,
        "x": round(vehicle.x_m, 2),
        "y": round(vehicle.y_m, 2),
        "h": round(vehicle.heading_rad, 3),
        "l": vehicle.length_m,
        "w": vehicle.width_m,
    }


def _column(states: list[VehicleState]) -> Json:
    crashed = next((index for index, state in enumerate(states) if state.crashed), None)
    return {
        "x": [round(state.x_m, 2) for state in states],
        "y": [round(state.y_m, 2) for state in states],
        "h": [round(state.heading_rad, 3) for state in states],
        "crashed": crashed,
    }


def _cars(shots: tuple[Observation, ...], sight: Bounds) -> list[Json]:
    """Every other car that comes into sight; one entry per unbroken stay on the road."""
    stays: dict[int, list[tuple[int, list[VehicleState]]]] = {}
    for index, shot in enumerate(shots):
        for car in shot.others:
            if not (sight.x0 <= car.x_m <= sight.x1 and sight.y0 <= car.y_m <= sight.y1):
                continue
            runs = stays.setdefault(car.id, [])
            if not runs or runs[-1][0] + len(runs[-1][1]) != index:
                runs.append((index, []))
            runs[-1][1].append(car)
    return [
        {
            "id": number,
            "first": first,
            "l": states[0].length_m,
            "w": states[0].width_m,
            "k": states[0].kind,
            **({} if states[0].colour is None else {"paint": css_colour(states[0].colour)}),
            "v": [round(state.speed_mps, 1) for state in states],
            **_column(states),
        }
        for number, runs in stays.items()
        for first, states in runs
    ]


def _lights(shots: tuple[Observation, ...], sight: Bounds) -> list[Json]:
    """Every traffic light that comes into sight: its stop line, and (instant, state) from each change on."""
    found: dict[str, Json] = {}
    for index, shot in enumerate(shots):
        for light in shot.signals:
            (ax, ay), (bx, by) = light.stop_line_m
            if not (sight.x0 <= ax <= sight.x1 and sight.y0 <= ay <= sight.y1):
                continue
            line = [round(value, 2) for value in (ax, ay, bx, by)]
            one = found.setdefault(light.id, {"p": line, "s": cast("list[list[Any]]", [])})
            if not one["s"] or one["s"][-1][1] != light.state:
                one["s"].append([index, light.state])
    return list(found.values())


def _goal(row: Frame | None, shot: Observation, road: PaintedRoad) -> int | None:
    """Index of the surface the policy wants to be on, while the ego is on another lane."""
    wanted: LaneId | None = row.setpoints.target_lane if row else None
    if wanted is None or wanted == shot.ego.lane:
        return None
    return next((index for index, surface in enumerate(road.surfaces) if surface.lane == wanted), None)


def _lane_words(shot: Observation) -> str:
    lane = shot.road.get(shot.ego.lane)
    if lane is None or shot.off_road:
        return "off the road"
    if lane.junction or len(shot.road.junctions) == 1:  # at a lone crossing the lanes of its arms have no numbers
        return ""
    if lane.emergency:
        return "emergency lane"
    count = sum(beside.kind in ("driving", "aisle") for beside in shot.road.abreast(lane.id))
    return f"lane {lane.index + 1} of {count}"
