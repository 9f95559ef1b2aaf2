"""A remembered trip as JSON, there and back."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, Literal

from chauffeur.concept import Feedback, HistoryItem, Program, Result, Trip, result_of
from chauffeur.concept.results import result_of_stored

MAX_CHARS = 20_000
"""Longest text kept per field: a runaway model reply must not fill a profile."""


def body_of(trip: Trip) -> str:
    """What is kept of a trip, as JSON. ASCII only, so that any string survives, lone surrogates included."""
    plan, policy = trip.plan, trip.plan.policy
    if policy is None:
        text = ""
    elif isinstance(policy, Program):
        text = policy.source
    else:
        text = json.dumps(asdict(policy))
    return json.dumps(
        {
            "instruction": _cut(trip.instruction.text),
            "context": _cut(" ".join(text for text in (trip.context.text, plan.scene) if text)),
            "intent": _cut(plan.intent),
            "thoughts": _cut(plan.thoughts.text or plan.refusal),
            "policy": _cut(text),
            "settings": [[name, value] for name, value in plan.settings],
            "outcome": trip.outcome,
            "result": str(result_of(trip)),
        }
    )


def result_of_kept(body: Mapping[str, Any]) -> Result:
    """The result of a kept trip; of one kept by an older version, by its outcome and intent."""
    return result_of_stored(body.get("result") or body["outcome"], body.get("intent", ""))


def feedback_body(feedback: Feedback) -> str:
    """Feedback as JSON."""
    return json.dumps(asdict(feedback) | {"text": _cut(feedback.text)})


def item_of(
    trip_id: str, when: str, world: str, body: str, feedback: tuple[str, ...], similarity: float = 0.0
) -> HistoryItem:
    """A history item from its stored parts."""
    fields: dict[str, Any] = json.loads(body)
    return HistoryItem(
        trip_id=trip_id,
        when=when,
        instruction=fields["instruction"],
        context=fields["context"],
        world=world,
        intent=fields["intent"],
        thoughts=fields["thoughts"],
        policy=fields["policy"],
        settings=tuple((name, value) for name, value in fields["settings"]),
        feedback=tuple(_feedback(one) for one in feedback),
        outcome=fields["outcome"],
        similarity=similarity,
    )


def _feedback(body: str) -> Feedback:
    fields: dict[str, Any] = json.loads(body)
    return Feedback(
        text=fields["text"],
        speed=_sign(fields["speed"]),
        gap=_sign(fields["gap"]),
        comfort=_sign(fields["comfort"]),
        approval=_sign(fields["approval"]),
        strength=fields["strength"],
    )


def _sign(value: float) -> Literal[-1, 0, 1]:
    if value == 0:
        return 0
    return 1 if value > 0 else -1


def _cut(text: str) -> str:
    return text if len(text) <= MAX_CHARS else text[: MAX_CHARS - 1] + "…"
