"""What one control period of a trip leaves behind."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from chauffeur.concept.scene import Command, Observation, Setpoints

ProgramState = Literal["none", "running", "finished", "failed"]
"""`none`: no program drives (a baseline, or it was refused); `finished`: it ended and the driver holds its wishes."""


@dataclass(frozen=True, slots=True)
class ApiCall:
    """One driving-API call of a program.

    Attributes:
        name: API name.
        args: Arguments as text.
        result: Result as text.
    """

    name: str
    args: str
    result: str


@dataclass(frozen=True, slots=True)
class Intervention:
    """One change the run-time shield made to a command.

    Attributes:
        rule: Short stable name of the rule.
        reason: Why, in words.
        before: The command as it came.
        after: As it went on.
    """

    rule: str
    reason: str
    before: Command
    after: Command


@dataclass(frozen=True, slots=True)
class Frame:
    """One control period: what was seen, wished, asked of the actuator and really applied.

    Attributes:
        observation: The instant before the command.
        wishes: What the policy wanted.
        requested: What the driver asked for.
        applied: What the world really did, after clipping.
        program: State of the program.
        line: Line of `Program.text` it waits at (1-based), if it runs: in a helper function, that function's own.
        said: Texts told to the passenger in this period.
        calls: Driving-API calls made in this period.
        interventions: What the run-time shield changed in what the driver asked for.
    """

    observation: Observation
    setpoints: Setpoints
    requested: Command
    applied: Command
    program: ProgramState = "none"
    line: int | None = None
    said: tuple[str, ...] = ()
    calls: tuple[ApiCall, ...] = ()
    interventions: tuple[Intervention, ...] = ()
