"""Recorded answers played back: the same run again, offline and for nothing.

A recording is a file of JSON lines. Each line answers one request, found by the hash of the request or else by the
words of the instruction and the number of earlier rounds; of several such lines the last counts:

    {"version": 1, "request": "<hash>", "instruction": "Pass it.", "round": 0, "plan": {...}}
    {"version": 1, "instruction": "Pass it.", "reply": "Thoughts: ...```python ...```"}

`plan` is a whole plan as `dataclasses.asdict` has it; `reply` is a model's words.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from chauffeur.concept import (
    ActionMatrix,
    DataError,
    Parameters,
    Plan,
    PlannerError,
    PlanRequest,
    Policy,
    Program,
    Thoughts,
    Trajectory,
    Usage,
)
from chauffeur.concept.utterance import Act
from chauffeur.planners.cache import content_key
from chauffeur.planners.llm_reply import read_reply

if TYPE_CHECKING:
    from pydantic import TypeAdapter

_VERSION = 1
_MAX_BYTES = 1_000_000_000


def request_key(request: PlanRequest) -> str:
    """Hash of everything a planner is given."""
    return content_key(asdict(request))


def _words(text: str) -> str:
    return " ".join(text.split()).casefold()


def _fields(line: bytes) -> Mapping[str, Any]:
    fields = json.loads(line)
    if fields["version"] != _VERSION:
        raise ValueError(f"version {fields['version']!r} instead of {_VERSION}")
    return fields


def _policy(value: Mapping[str, Any] | None) -> Policy | None:
    if value is None:
        return None
    fields = dict(value)
    kind = fields.pop("kind", "program")
    if kind == "program":
        return Program(str(fields["source"]), library=str(fields.get("library", "")))
    if kind == "parameters":
        return Parameters(**fields)
    if kind == "action_matrix":
        return ActionMatrix(pid=_three(fields["pid"]), mpc=_three(fields["mpc"]))
    if kind == "trajectory":
        points = tuple((float(x), float(y)) for x, y in fields["waypoints_m"])
        return Trajectory(waypoints_m=points, period_s=float(fields["period_s"]))
    raise ValueError(f"unknown kind of policy {kind!r}")


def _three(values: Any) -> tuple[float, float, float]:
    first, second, third = values
    return float(first), float(second), float(third)


@cache  # it takes milliseconds to make, and a recording has a line a plan
def _acts_reader() -> TypeAdapter[tuple[Act, ...]]:
    from pydantic import TypeAdapter  # imported late: most recordings hold no acts

    return TypeAdapter(tuple[Act, ...])


def _acts(value: Any) -> tuple[Act, ...]:
    return _acts_reader().validate_python(value) if value else ()


def _plan(line: Mapping[str, Any]) -> Plan:
    if "plan" not in line:
        raw = str(line["reply"])
        reply = read_reply(raw)
        policy = Program(reply.source) if reply.source is not None else None
        return Plan(thoughts=Thoughts(reply.thoughts), policy=policy, refusal=reply.refusal or reply.problem, raw=raw)
    fields = dict(line["plan"])
    return Plan(
        thoughts=Thoughts(str(fields.pop("thoughts")["text"])),
        policy=_policy(fields.pop("policy")),
        settings=tuple((str(name), float(value)) for name, value in fields.pop("settings", ())),
        acts=_acts(fields.pop("acts", ())),
        usage=Usage(**fields.pop("usage", {})),
        **fields,
    )


class ReplayPlanner:
    """Answers from a recording; for the same request always with the same plan.

    Args:
        path: The recording.

    Raises:
        DataError: The recording is missing or a line of it cannot be read.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._by_request: dict[str, Plan] = {}
        self._by_words: dict[tuple[str, int], Plan] = {}
        try:
            if path.stat().st_size > _MAX_BYTES:
                raise DataError(f"The recording {path} is larger than {_MAX_BYTES} bytes.")
            content = path.read_bytes()
        except OSError as error:
            raise DataError(
                f"The recording {path} cannot be read: {error.strerror}.", hint="Give the path of a JSON-lines file."
            ) from error
        for number, line in enumerate(content.split(b"\n"), start=1):
            if line.strip():
                self._take(number, line)
        self._model = f"sha256:{hashlib.sha256(content).hexdigest()[:16]}"

    @classmethod
    def from_spec(cls, argument: str) -> ReplayPlanner:
        """Planner for `replay/<path>`."""
        if not argument:
            raise DataError("The replay planner needs a recording.", hint="Write for example replay/run.jsonl.")
        return cls(Path(argument).expanduser())

    @property
    def id(self) -> str:
        """`replay/<file name>`."""
        return f"replay/{self._path.name}"

    @property
    def model(self) -> str:
        """Hash of the recording."""
        return self._model

    async def plan(self, request: PlanRequest) -> Plan:
        """The recorded plan, marked as this planner's and as costing nothing; `Plan.model` stays the one recorded.

        Raises:
            PlannerError: The recording has no answer to this request.
        """
        words = (_words(request.instruction.text), len(request.rounds))
        plan = self._by_request.get(request_key(request)) or self._by_words.get(words)
        if plan is None:
            raise PlannerError(
                f"{self._path} holds no answer to {request.instruction.text[:80]!r} in round {len(request.rounds)}.",
                hint="Write a line for it: the module `chauffeur.planners.replay` says how.",
            )
        usage = replace(plan.usage, cost_usd=0.0, requests=0, cached=True)
        return replace(plan, planner=self.id, model=plan.model or self._model, usage=usage, latency_s=0.0)

    def _take(self, number: int, line: bytes) -> None:
        try:
            fields = _fields(line)
            plan = _plan(fields)
            words = (_words(str(fields["instruction"])), int(fields.get("round", 0)))
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
            raise DataError(
                f"Line {number} of {self._path} is not a recorded answer ({error}).",
                hint="Remove the line, or record it again.",
            ) from error
        self._by_words[words] = plan
        if isinstance(fields.get("request"), str):
            self._by_request[fields["request"]] = plan
