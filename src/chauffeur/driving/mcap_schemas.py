"""The channels a recorded trip is read back from: topic, schema name and JSON schema, as any MCAP reader finds them.

Schemas stay within the subset that viewers understand: plain types, no references. What is there to be drawn has
channels of its own, in `foxglove.py`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

JsonSchema = dict[str, Any]


def _object(**properties: JsonSchema) -> JsonSchema:
    return {"type": "object", "properties": properties}


def _array(items: JsonSchema, description: str = "") -> JsonSchema:
    schema: JsonSchema = {"type": "array", "items": items}
    return {**schema, "description": description} if description else schema


def _number(description: str = "") -> JsonSchema:
    return {"type": "number", "description": description} if description else {"type": "number"}


def _text(description: str = "") -> JsonSchema:
    return {"type": "string", "description": description} if description else {"type": "string"}


def _optional_number(description: str) -> JsonSchema:
    return {"type": ["number", "null"], "description": description}


_INTEGER: JsonSchema = {"type": "integer"}
_FLAG: JsonSchema = {"type": "boolean"}
_ANY_OBJECT: JsonSchema = {"type": "object"}
_LANE: JsonSchema = {"type": ["string", "null"], "description": "Name of a lane of the road graph"}
_LINE: JsonSchema = {"type": ["array", "null"], "items": _array(_number()), "description": "Ends of the stop line, m"}
_SETTINGS = _array(_array({"type": ["string", "number"]}), "[name, value] pairs")

_VEHICLE = _object(
    id=_INTEGER,
    kind=_text("car, truck, bus, motorcycle, bicycle, pedestrian, static, obstacle or stop_sign"),
    x_m=_number("Centre; world frame, right-handed"),
    y_m=_number("Centre"),
    heading_rad=_number("Counter-clockwise"),
    speed_mps=_number(),
    length_m=_number(),
    width_m=_number(),
    lane=_LANE,
    crashed=_FLAG,
    acceleration_mps2=_number("Along the heading"),
    yaw_rate_radps=_number("Counter-clockwise"),
    steering_rad=_number("Front wheels, positive to the left"),
    colour={"type": ["string", "null"], "description": "Of its paint or clothes, where the world says one"},
)
_COMMAND = _object(
    acceleration_mps2=_number("Along the heading"), steering_rad=_number("Front wheels, positive to the left")
)


@dataclass(frozen=True, slots=True)
class Channel:
    """One MCAP channel.

    Attributes:
        topic: Name within the file.
        schema_name: Name of its JSON schema.
        schema: The JSON schema.
    """

    topic: str
    schema_name: str
    schema: JsonSchema


INSTRUCTION = Channel(
    "/instruction",
    "chauffeur.Instruction",
    _object(
        text=_text("I: the wish"),
        person=_text(),
        source=_text(),
        confirmed=_text("question it is the yes to"),
        said=_text("the words as they came, where `text` is a whole sentence for them"),
    ),
)
CONTEXT = Channel(
    "/context",
    "chauffeur.Context",
    _object(
        text=_text("C: the driving context"),
        situation=_ANY_OBJECT,
        lot={"type": ["object", "null"]},
        street={"type": ["object", "null"], "description": "On a road: ways on, and what there is to stop by"},
    ),
)
SYSTEM = Channel(
    "/system",
    "chauffeur.SystemMessage",
    _object(text=_text("S: the system message"), setting=_text(), library=_text("helper functions that S offers")),
)
HISTORY = Channel(
    "/history", "chauffeur.History", _object(items=_array(_ANY_OBJECT, "H: what memory recalled, nearest first"))
)
PLAN = Channel(
    "/plan",
    "chauffeur.Plan",
    _object(
        thoughts=_object(text=_text("R: the reasoning")),
        policy={"type": ["object", "null"], "description": "P: the policy"},
        refusal=_text(),
        offer=_text("the wish that a yes stands for, where the refusal is a question"),
        intent=_text(),
        alarm=_text("stop or distress, where the words were taken for that"),
        unused={"type": ["array", "null"], "description": "Parts of the wish that the policy does not use"},
        acts=_array(_ANY_OBJECT, "What the policy does, as the planner claims"),
        settings=_SETTINGS,
        planner=_text(),
        model=_text(),
        usage=_ANY_OBJECT,
        latency_s=_number(),
        raw=_text(),
        scene=_text("what a planner with eyes made of its pictures"),
    ),
)
VERDICTS = Channel(
    "/verdicts",
    "chauffeur.Verdicts",
    _object(
        verdicts=_array(
            _object(
                check=_text(),
                passed=_FLAG,
                reason=_text(),
                line={"type": ["integer", "null"]},
                remedy=_text(),
                vetoes=_FLAG,
                alignment={"type": ["object", "null"]},
                proven=_FLAG,
                not_compared={"type": ["string", "null"]},
            )
        )
    ),
)
SCENARIO = Channel(
    "/scenario",
    "chauffeur.Scenario",
    _object(
        id=_text(), world=_text(), config=_ANY_OBJECT, seed=_INTEGER, goal=_ANY_OBJECT, wish=_text(), title=_text()
    ),
)
TRIP = Channel(
    "/trip",
    "chauffeur.Trip",
    _object(
        id=_text(),
        outcome=_text(),
        causes=_ANY_OBJECT,
        metrics=_array(_object(id=_text(), value=_number(), unit=_text(), applies=_FLAG)),
        duration_s=_number(),
        scenario=_text(),
        seed=_INTEGER,
        said=_array(_array({"type": ["number", "string"]}), "[time s, text] pairs"),
        record=_array(_array({}), "[name, value] pairs of provenance"),
        unused=_array(_text(), "Parts of the wish that the plan does not use"),
        parts=_array(_object(result=_text(), words=_text(), why=_text()), "Things asked for, and what became of each"),
        judged_by=_text("words, plan, goal, place, reading, labels, or empty"),
    ),
)
LANES = Channel(
    "/lanes",
    "chauffeur.Lanes",
    _object(
        lanes=_array(
            _object(
                id=_LANE,
                width_m=_number(),
                speed_limit_mps=_number(),
                kind=_text("driving, emergency, aisle, parking, bicycle, sidewalk or crossing"),
                road=_text("Lanes of one road lie abreast"),
                index=_INTEGER,
                successors=_array(_text(), "Lanes it leads into"),
                closed=_FLAG,
                junction=_text(),
                turn=_text(),
                street=_text(),
                centre_m=_array(_array(_number()), "[x, y] points, start to end"),
            )
        ),
        lot={"type": ["object", "null"], "description": "Of a parking lot: spots and landmarks"},
    ),
)
OBSERVATION = Channel(
    "/observation",
    "chauffeur.Observation",
    _object(
        time_s=_number(),
        tick=_INTEGER,
        kind=_text(),
        ego=_VEHICLE,
        others=_array(_VEHICLE),
        objects=_array(_VEHICLE),
        front={"type": ["object", "null"], "description": "Vehicle ahead: vehicle, distance_m, speed_mps"},
        stop_sign_m=_optional_number("Distance to an unserved stop sign ahead"),
        off_road=_FLAG,
        ended=_FLAG,
        signals=_array(
            _object(
                id=_text(),
                state=_text("red, yellow, green or off"),
                lanes=_array(_text(), "Lanes it rules"),
                stop_line_m=_LINE,
                remaining_s=_optional_number("Until it changes"),
            )
        ),
        signs=_array(
            _object(
                id=_text(),
                kind=_text("stop, yield or speed_limit"),
                lanes=_array(_text(), "Lanes it rules"),
                x_m=_number(),
                y_m=_number(),
                stop_line_m=_LINE,
                value=_optional_number("Of a speed limit: m/s"),
            )
        ),
        route={"type": ["object", "null"], "description": "lanes, start_m on the first, goal_m on the last"},
    ),
)
WISHES = Channel(
    "/wishes",
    "chauffeur.Setpoints",
    _object(
        target_speed_mps=_optional_number("None keeps the present speed"),
        time_headway_s=_number(),
        target_lane=_LANE,
        turn={"type": ["string", "null"]},
        served_stops=_array(_INTEGER),
    ),
)
COMMAND = Channel(
    "/command",
    "chauffeur.Command",
    _object(
        requested=_COMMAND,
        applied=_COMMAND,
        interventions=_array(_object(rule=_text(), reason=_text(), before=_COMMAND, after=_COMMAND)),
    ),
)
PROGRAM = Channel(
    "/program",
    "chauffeur.ProgramState",
    _object(
        state=_text("none, running, finished or failed"),
        line={"type": ["integer", "null"], "description": "Program line it waits at, from 1"},
        calls=_array(_object(name=_text(), args=_text(), result=_text())),
    ),
)
SAID = Channel("/said", "chauffeur.Said", _object(text=_text("What the car told the passenger")))
CHANNELS = (
    INSTRUCTION,
    CONTEXT,
    SYSTEM,
    HISTORY,
    PLAN,
    VERDICTS,
    SCENARIO,
    TRIP,
    LANES,
    OBSERVATION,
    WISHES,
    COMMAND,
    PROGRAM,
    SAID,
)
"""All of them, in the order in which they are registered."""
