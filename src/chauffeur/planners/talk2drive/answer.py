"""A model's reply as parameters: one JSON object, typed, within bounds. Nothing of it is ever run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from chauffeur.concept import Parameters
from chauffeur.concept.units import MPS_PER_KMH
from chauffeur.foreign.fields import objects_in, says_nothing
from chauffeur.foreign.model_text import read_model_text
from chauffeur.planners.talk2drive.style import DISTANCE_M, RATIO_S

_MOST_KMH: Final = 250.0
_MOST_SAID: Final = 4_000
_CUT: Final = "the answer was cut off at its length limit; answer more briefly"
_LANES: Final[dict[str, Literal[-1, 0, 1]]] = {"left": -1, "keep": 0, "right": 1}


class _Written(BaseModel):
    """The object as the system message asks for it."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    thoughts: Annotated[str, Field(max_length=_MOST_SAID)] | None = None
    refusal: Annotated[str, Field(max_length=_MOST_SAID)] | None = None
    velocity_kmh: Annotated[float, Field(ge=0.0, le=_MOST_KMH, strict=True)] | None = None
    lookahead_distance_m: Annotated[float, Field(ge=DISTANCE_M[0], le=DISTANCE_M[1], strict=True)] | None = None
    lookahead_ratio_s: Annotated[float, Field(ge=RATIO_S[0], le=RATIO_S[1], strict=True)] | None = None
    lane: Literal["left", "keep", "right"] | None = None


_FIELDS: Final = frozenset(_Written.model_fields) - {"thoughts"}


@dataclass(frozen=True, slots=True)
class ParametersAnswer:
    """A reply as parameters, a refusal, or a problem.

    Attributes:
        thoughts: R.
        parameters: P; None where there are none.
        refusal: Why the model declines.
        problem: What is wrong, for the model's second try.
    """

    thoughts: str
    parameters: Parameters | None = None
    refusal: str = ""
    problem: str = ""


def read_answer(text: str, *, whole: bool = True) -> ParametersAnswer:
    """Read a reply; nothing raises. Two different objects are no answer: the last is not better for being last.

    Args:
        text: As the model wrote it; words around the object are passed over.
        whole: Whether the model came to its end by itself.
    """
    said = read_model_text(text, cut=not whole)
    objects = [one for one in objects_in(said.answer) if not _FIELDS.isdisjoint(one)]
    if not objects:
        return ParametersAnswer("", problem=_CUT if said.cut else "there is no JSON object with the parameters")
    found = {name: None if name == "refusal" and says_nothing(value) else value for name, value in objects[0].items()}
    if any({**one, "thoughts": ""} != {**objects[0], "thoughts": ""} for one in objects):
        return ParametersAnswer(_words(found.get("thoughts")), problem="there are different JSON objects; give one")
    try:
        written = _Written.model_validate(found)
    except ValidationError as error:
        return ParametersAnswer(_words(found.get("thoughts")), problem=_said(error))
    thoughts = (written.thoughts or "").strip()
    if written.refusal:
        return ParametersAnswer(thoughts, refusal=written.refusal.strip())
    missing = [
        name for name in ("velocity_kmh", "lookahead_distance_m", "lookahead_ratio_s") if getattr(written, name) is None
    ]
    if missing:
        return ParametersAnswer(thoughts, problem=f"missing: {', '.join(missing)}")
    assert written.velocity_kmh is not None
    assert written.lookahead_distance_m is not None
    assert written.lookahead_ratio_s is not None
    return ParametersAnswer(
        thoughts,
        Parameters(
            written.velocity_kmh * MPS_PER_KMH,
            written.lookahead_distance_m,
            written.lookahead_ratio_s,
            _LANES[written.lane or "keep"],
        ),
    )


def _words(value: object) -> str:
    return value.strip()[:_MOST_SAID] if isinstance(value, str) else ""


def _said(error: ValidationError) -> str:
    return "; ".join(f"{'.'.join(map(str, each['loc'])) or 'object'}: {each['msg']}" for each in error.errors()[:6])
