"""The nouns of the LLM4AD concept (paper Sec. II, Tab. I): I, C, S, H, F, R, P and what surrounds them.

All are frozen values. The paper's letter stands in each docstring.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, NewType

from chauffeur.concept.images import CameraImage
from chauffeur.concept.utterance import Act, Utterance

if TYPE_CHECKING:
    from chauffeur.concept.scene import Observation

PersonId = NewType("PersonId", str)
"""Name a person's memory is kept under; only `memory` knows what file that means."""

NOBODY = PersonId("")
"""No profile: nothing is recalled and nothing is remembered."""


@dataclass(frozen=True, slots=True)
class Instruction:
    """I: what the person wants, in their own words.

    Attributes:
        text: The words, stripped.
        person: Whose words they are; `NOBODY` when unknown.
        source: How they came in.
        confirmed: The question of the car that the person has answered with yes; empty for none.
        said: The words as they came, where `text` is a whole sentence for them ("the other one"); empty elsewhere.
    """

    text: str
    person: PersonId = NOBODY
    source: Literal["text", "speech", "benchmark"] = "text"
    confirmed: str = ""
    said: str = ""


@dataclass(frozen=True, slots=True)
class Lead:
    """A vehicle ahead or behind, as seen along a lane.

    Attributes:
        vehicle: Its id in the observation.
        distance_m: Centre to centre along the lane, always positive.
        speed_mps: Its speed.
    """

    vehicle: int
    distance_m: float
    speed_mps: float


@dataclass(frozen=True, slots=True)
class Situation:
    """C as a typed object: what the situation descriptor put into words.

    Attributes:
        world: Kind of road: `highway` or `intersection` (other worlds add theirs).
        speed_mps: Ego speed.
        speed_limit_mps: Limit of the ego lane.
        lane_count: Lanes in the ego's direction, the emergency lane included.
        lane_index: Ego lane, 0 is leftmost.
        emergency_lane: Whether the rightmost lane is an emergency lane.
        front: Vehicle ahead in the ego lane within 100 m, if any.
        stop_sign_m: Distance to the stop sign ahead, if any.
        turns: Directions the next intersection allows; empty where there is none.
        scene: Further facts a world may add (weather, road name), as text values.
    """

    world: str
    speed_mps: float
    speed_limit_mps: float
    lane_count: int
    lane_index: int
    emergency_lane: bool
    front: Lead | None
    stop_sign_m: float | None
    turns: tuple[Literal["left", "straight", "right"], ...] = ()
    scene: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, slots=True)
class ParkingSpot:
    """A spot of a parking lot.

    Attributes:
        name: Row letter and number, counted from the drive in: `B4`.
        x_m, y_m: Its centre.
        heading_rad: Of a car that is parked in it forwards.
        free: Whether nobody stands in it.
        kind: Whom it is kept for.
        covered: Whether it is under a roof.
        neighbours: Cars in the spots directly beside it, 0 to 2.
        row_end: Whether it is the first or last of its row.
    """

    name: str
    x_m: float
    y_m: float
    heading_rad: float
    free: bool
    kind: Literal["plain", "ev", "accessible", "family"] = "plain"
    covered: bool = False
    neighbours: int = 0
    row_end: bool = False


@dataclass(frozen=True, slots=True)
class ParkingLot:
    """What a parking lot offers, in the world frame of a snapshot, or in the ego frame of a context.

    Attributes:
        spots: All spots.
        landmarks: (name, x, y) of `exit`, `entrance`, `gate` (the building's door), and where there are: `lift`,
            `stairs`, `machine` (where one pays).
    """

    spots: tuple[ParkingSpot, ...]
    landmarks: tuple[tuple[str, float, float], ...]


@dataclass(frozen=True, slots=True)
class StreetWay:
    """A way on from where the car is: along its lane, and through the next junction to one side.

    Attributes:
        turn: Which way it leads; `straight` where the road does not part.
        length_m: As far as it is known.
        bend_m: Stations between which it crosses the junction; None without one.
        radius_m: Of the bend there; None where it goes straight on.
        kerb_m: From the middle of its lane to the right to where one can stand at the kerb; None where one cannot.
        path_m: Middle of the lane in the ego frame (x forward, y left), from beside the car on.
    """

    turn: Literal["left", "straight", "right"]
    length_m: float
    bend_m: tuple[float, float] | None = None
    radius_m: float | None = None
    kerb_m: float | None = None
    path_m: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True, slots=True)
class StreetMark:
    """Something to stop by.

    Attributes:
        kind: What it is.
        ways: The ways that lead past it.
        start_m, end_m: Stations of those ways between which it lies.
    """

    kind: Literal["crosswalk", "junction", "cones", "vehicle"]
    ways: tuple[Literal["left", "straight", "right"], ...]
    start_m: float
    end_m: float


@dataclass(frozen=True, slots=True)
class Street:
    """The road ahead as far as a short drive leads. Stations are counted from beside the middle of the car.

    Attributes:
        ways: Ways on.
        marks: What stands or lies along them.
        speed_mps: Of the car.
    """

    ways: tuple[StreetWay, ...]
    marks: tuple[StreetMark, ...]
    speed_mps: float


@dataclass(frozen=True, slots=True)
class Context:
    """C: the driving context, in words for the model and as values for the checks.

    Attributes:
        text: In words.
        situation: As values.
        lot: In a parking lot: its spots, in the ego frame (x forward, y left).
        street: On a road: ways on, and what there is to stop by.
    """

    text: str
    situation: Situation
    lot: ParkingLot | None = None
    street: Street | None = None


@dataclass(frozen=True, slots=True)
class SystemMessage:
    """S: role, rules, driving-API documentation and examples given to the model.

    Attributes:
        text: The words.
        setting: How the model learns the task.
        library: Helper functions that the text offers; what a program uses of them travels with it.
    """

    text: str
    setting: Literal["zero-shot", "few-shot", "human-feedback"] = "zero-shot"
    library: str = ""


@dataclass(frozen=True, slots=True)
class Thoughts:
    """R: the model's reasoning, shown to the person.

    >>> chauffeur.Thoughts("The lane to the left is free.").text
    'The lane to the left is free.'
    """

    text: str


@dataclass(frozen=True, slots=True)
class Program:
    """P as a language-model program: a generator function over the driving APIs (paper Sec. II-F).

    Attributes:
        source: Program text exactly as the planner gave it.
        library: Helper functions that it calls with `yield from`, e.g. of a policy repository; checked and driven
            together with it.

    >>> program = chauffeur.Program("def drive():\\n    set_target_speed(22)\\n    yield autopilot()\\n")
    >>> program.kind, program.text.count("\\n")
    ('program', 3)
    """

    source: str
    kind: Literal["program"] = "program"
    library: str = ""

    @property
    def text(self) -> str:
        """Program and helper functions as one text, as it is shown; the lines of a drive count in it."""
        if not self.library:
            return self.source
        return f"{self.source.rstrip()}{HELPERS_HEAD}{self.library.rstrip()}\n"


HELPERS_HEAD = "\n\n\n# Helper functions that it may call:\n"
"""Stands between a program and its helper functions."""


def lines_before_library(source: str) -> int:
    """How many lines of `Program.text` stand before its helper functions."""
    return source.rstrip().count("\n") + HELPERS_HEAD.count("\n")


@dataclass(frozen=True, slots=True)
class Parameters:
    """P as controller parameters (Talk2Drive, paper Eq. 15).

    Attributes:
        target_speed_mps: Speed to drive.
        look_ahead_m: Pure-pursuit look-ahead distance.
        look_ahead_ratio: Look-ahead per speed, in seconds.
        lane: Lane wish relative to the present one: -1 left, 0 stay, +1 right.
        route: Where to go where ways part: `left`, `straight`, `right`; in a parking lot `nearest`, `stadium`, `exit`
            or the name of a spot. Empty for the way as it goes.

    >>> chauffeur.Parameters(target_speed_mps=22.0, look_ahead_m=8.0, look_ahead_ratio=0.6, lane=-1).kind
    'parameters'
    """

    target_speed_mps: float
    look_ahead_m: float
    look_ahead_ratio: float
    lane: Literal[-1, 0, 1] = 0
    route: str = ""
    kind: Literal["parameters"] = "parameters"


@dataclass(frozen=True, slots=True)
class ActionMatrix:
    """P as the on-board VLM's action matrix (paper Eq. 22): PID gains and MPC weights.

    Attributes:
        pid: (Kp, Ki, Kd).
        mpc: (Wl, Wh, Ws): lateral error, heading error and steering-effort weights.
    """

    pid: tuple[float, float, float]
    mpc: tuple[float, float, float]
    kind: Literal["action_matrix"] = "action_matrix"


@dataclass(frozen=True, slots=True)
class Trajectory:
    """P as waypoints in the ego frame at a fixed period.

    Attributes:
        waypoints_m: ((x forward, y left), ...), metres.
        period_s: Time between waypoints.
    """

    waypoints_m: tuple[tuple[float, float], ...]
    period_s: float
    kind: Literal["trajectory"] = "trajectory"


Policy = Program | Parameters | ActionMatrix | Trajectory


@dataclass(frozen=True, slots=True)
class Feedback:
    """F: what the person said of the drive, and what it means.

    Attributes:
        text: Their words.
        speed: -1 the drive was too fast, +1 too slow, 0 not about speed.
        gap: -1 the gap was too small (too close), +1 too large, 0 not about the gap.
        comfort: -1 too harsh, +1 too timid, 0 not about comfort.
        approval: -1 disliked, 0 neutral or mixed, +1 liked as it was.
        strength: 0..1: "a bit" is 0.35, plain 0.6, "much" 1.0; 0 when nothing should change.
    """

    text: str
    speed: Literal[-1, 0, 1] = 0
    gap: Literal[-1, 0, 1] = 0
    comfort: Literal[-1, 0, 1] = 0
    approval: Literal[-1, 0, 1] = 0
    strength: float = 0.0


@dataclass(frozen=True, slots=True)
class HistoryItem:
    """One remembered interaction: (I, C, R, P, F), when, and how it ended.

    Attributes:
        trip_id: The trip it came from.
        when: ISO 8601 UTC time.
        instruction: Words of the wish.
        context: Words of the situation.
        world: World kind.
        intent: Tag of what was understood, e.g. `speed.increase` (planner's tag, may be empty).
        thoughts: R.
        policy: P as text.
        settings: Numbers that P used, e.g. `target_speed_mps`, `time_headway_s`.
        feedback: F, newest last.
        outcome: One word of how the trip ended.
        similarity: 0..1 against the present wish; set by recall.
    """

    trip_id: str
    when: str
    instruction: str
    context: str
    world: str
    intent: str
    thoughts: str
    policy: str
    settings: tuple[tuple[str, float], ...] = ()
    feedback: tuple[Feedback, ...] = ()
    outcome: str = ""
    similarity: float = 0.0


@dataclass(frozen=True, slots=True)
class History:
    """H: what memory holds that bears on the present wish, most relevant first."""

    items: tuple[HistoryItem, ...] = ()


@dataclass(frozen=True, slots=True)
class Round:
    """An earlier attempt at the same wish and what was said of it (repair or human feedback)."""

    plan_text: str
    feedback: str


@dataclass(frozen=True, slots=True)
class Limits:
    """Bounds no plan may cross. The road's own limits come from the observation; these come from person and operator.

    Attributes:
        name: Shown beside every result driven under these limits.
        max_over_limit_mps: Tolerated excess over the lane's speed limit.
        min_time_headway_s: Smallest desired time headway a plan may ask for.
        max_time_headway_s: Largest.
        max_speed_mps: The person's or operator's own cap, whatever the sign says; None for none.
    """

    name: str = "default"
    max_over_limit_mps: float = 1.0
    min_time_headway_s: float = 0.5
    max_time_headway_s: float = 10.0
    max_speed_mps: float | None = None

    def most_mps(self, sign_mps: float) -> float:
        """Highest speed where the lane's speed limit is `sign_mps`, m/s."""
        tolerated = sign_mps + self.max_over_limit_mps
        return tolerated if self.max_speed_mps is None else min(tolerated, self.max_speed_mps)


LAMPILOT_LIMITS = Limits(name="lampilot", max_over_limit_mps=9.0, min_time_headway_s=0.01)
"""What LaMPilot's own APIs accept. Its tasks ask for 38.3 m/s on a 31.3 m/s road and for gaps of 15 m at 30 m/s."""


@dataclass(frozen=True, slots=True)
class PlanRequest:
    """Everything a planner is given: I, C, S, H, V (pictures), the limits it is told of, and earlier rounds.

    `observation` is the instant that C describes, as values, for planners that look for what words point at; None where
    there is none, or the planner is to see by pictures alone. `utterance` is what the words mean, resolved against
    the turn before; None where nobody has read them.

    >>> class Deaf:
    ...     id, model = "deaf", "deaf-v1"
    ...
    ...     async def plan(self, request: chauffeur.PlanRequest) -> chauffeur.Plan:
    ...         words = f"I do not know what {request.instruction.text!r} means."
    ...         return chauffeur.Plan(chauffeur.Thoughts(words), None, refusal=words, planner=self.id, model=self.model)
    >>> chauffeur.drive("Go.", planner=Deaf(), scenario="cruise").trip.plan.refusal
    "I do not know what 'Go.' means."
    """

    instruction: Instruction
    context: Context
    system: SystemMessage
    history: History = field(default_factory=History)
    rounds: tuple[Round, ...] = ()
    limits: Limits = field(default_factory=Limits)
    images: tuple[CameraImage, ...] = ()
    observation: Observation | None = field(default=None, repr=False, compare=False)
    utterance: Utterance | None = field(default=None, repr=False, compare=False)


@dataclass(frozen=True, slots=True)
class Usage:
    """What a plan cost.

    Attributes:
        prompt_tokens: Tokens in, 0 for planners without a token model.
        completion_tokens: Tokens out.
        cost_usd: Price where the price list is known, else None.
        requests: Calls made, retries included.
        cached: Whether the answer came from the response cache.
    """

    prompt_tokens: int = 0
    completion_tokens: int = 0
    cost_usd: float | None = None
    requests: int = 0
    cached: bool = False


Alarm = Literal["", "stop", "distress"]
"""What a planner took words for that is no wish to be weighed: a call to stop at once; a person or the car in distress.
The car's emergency manoeuvre answers it, whatever the planner would have done."""


@dataclass(frozen=True, slots=True)
class Plan:
    """(R, P) and how they came about.

    Attributes:
        thoughts: R.
        policy: P; None when the planner declined (see `refusal`) or gave nothing usable.
        refusal: Why there is no policy, in words for the person: not understood, impossible, off topic.
        offer: Where `refusal` is a question: the wish that a yes stands for; empty where a yes answers nothing.
        intent: Short tag of what was understood, e.g. `overtake.left`; empty when the planner has none.
        settings: Numbers the policy relies on, e.g. (("target_speed_mps", 28.0),).
        planner: Planner id, e.g. `onboard`.
        model: Model id and version within the planner.
        usage: Cost.
        latency_s: Wish in, plan out.
        raw: The reply as it came, for the record.
        scene: C as the planner itself saw it in pictures, in words; memory keeps it (Eq. 23). Empty without pictures.
        alarm: Where the words were understood as an alarm; empty where they were not.
        unused: Parts of the wish, as said, that the policy does not use; None where the planner does not tell.
        acts: What the policy does, in order, as the planner claims; empty where it does not tell.

    >>> words = "A car cannot fly."
    >>> chauffeur.Plan(chauffeur.Thoughts(words), None, refusal=words, planner="mine").policy is None
    True
    """

    thoughts: Thoughts
    policy: Policy | None
    refusal: str = ""
    offer: str = ""
    intent: str = ""
    settings: tuple[tuple[str, float], ...] = ()
    planner: str = ""
    model: str = ""
    usage: Usage = field(default_factory=Usage)
    latency_s: float = 0.0
    raw: str = ""
    scene: str = ""
    alarm: Alarm = ""
    unused: tuple[str, ...] | None = None
    acts: tuple[Act, ...] = ()


MismatchKind = Literal[
    "wrong-side", "wrong-number", "wrong-sign", "wrong-order", "missing-condition", "not-done", "not-claimed"
]  # fmt: skip
"""How R and P may disagree: another side than said; another number or unit; faster for slower, closer for farther;
another order; a check or a condition that is said and not there; something said and not done; done and not said."""


@dataclass(frozen=True, slots=True)
class Mismatch:
    """Something the thoughts R and the program P disagree about.

    Attributes:
        kind: What is wrong.
        sentence: The sentence of R; empty where P does what no sentence tells.
        instead: What P does.
        line: Program line, 1-based, where it is known.
    """

    kind: MismatchKind
    sentence: str
    instead: str
    line: int | None = None


@dataclass(frozen=True, slots=True)
class Faithfulness:
    """How well R describes P, or a drive.

    Attributes:
        aligned: Whether nothing was found that is wrong.
        score: 1 where every claim holds; the more claims fail, the less.
        mismatches: What is wrong, in the order of the text.
        claims: How many claims were compared.
    """

    aligned: bool
    score: float
    mismatches: tuple[Mismatch, ...]
    claims: int


NotCompared = Literal[
    "no-policy", "no-program", "no-explanation", "no-claims", "unreadable", "policy-failed", "no-rule-here",
    "own-manoeuvre", "check-broke", "road-users",
]  # fmt: skip
"""Why a check compared nothing: there is no policy, or none that is a program; no explanation, or one that claims
nothing; the program cannot be read, or failed on the way; the rule does not hold here; it is the car's own emergency
manoeuvre; the check itself failed; the program is about road users by name, which no text is compared with."""

Comparison = Literal["held", "failed", "not_compared"]
"""State of a verdict: compared and held, compared and failed, nothing compared."""

Mark = Literal["passed", "open", "differs", "failed", "not_compared"]
"""Of a verdict: right; nothing known to be wrong, and not proven; wrong, which stops nothing; wrong; nothing was
compared."""


def mark_of(*, passed: bool, vetoes: bool, proven: bool = True, compared: bool = True) -> Mark:
    """The one place where it is decided what deserves a tick."""
    if not compared and (passed or not vetoes):
        return "not_compared"
    if passed:
        return "passed" if proven else "open"
    return "failed" if vetoes else "differs"


@dataclass(frozen=True, slots=True)
class Verdict:
    """What one check thinks of a plan.

    Attributes:
        check: Versioned id of the check, e.g. `format-v1`.
        passed: Whether nothing is wrong.
        reason: In words, for the person and for the model's repair turn.
        line: Program line it refers to, if any.
        remedy: What would make it pass.
        vetoes: Whether a plan that does not pass is not driven; otherwise the verdict informs.
        alignment: Of a check that compares R with P or with what P did: what it found.
        proven: Whether what passed was shown to be right; otherwise nothing is known to be wrong, and `reason` tells
            what stayed open.
        not_compared: Why there was nothing to compare; None where something was. Such a verdict stops nothing unless it
            did not pass.
    """

    check: str
    passed: bool
    reason: str
    line: int | None = None
    remedy: str = ""
    vetoes: bool = True
    alignment: Faithfulness | None = None
    proven: bool = True
    not_compared: NotCompared | None = None

    @property
    def state(self) -> Comparison:
        """Compared and held, compared and failed, or not compared."""
        if self.not_compared is not None:
            return "not_compared"
        return "held" if self.passed else "failed"

    @property
    def mark(self) -> Mark:
        """How it is marked wherever it is shown: only what was shown to be right gets a tick."""
        compared = self.not_compared is None
        return mark_of(passed=self.passed, vetoes=self.vetoes, proven=self.proven, compared=compared)

    @property
    def stops(self) -> bool:
        """Whether the plan must not be driven because of it."""
        return self.vetoes and not self.passed


Outcome = Literal["success", "failure", "collision", "off_road", "timeout", "ended", "refused", "not_driven"]
"""What happened. Why it happened is in `Causes`."""


JudgedBy = Literal["words", "plan", "goal", "place", "reading", "labels"]
"""What a drive is held against: the words, read by rules that see no plan (recordings of older versions); what the
planner says it does, where the reading of the words is unsure or finds nothing, and where only the plan has a number
(judge and judged then share that); the scenario's own goal; the place that the plan leads to, found by the planner and
reached by the world's own geometry; the learned reading of the words, which the planner may share, over geometry that
it does not; labels by people, over the same geometry."""


PartResult = Literal["done", "not_done", "opposite", "not_judged"]
"""What became of a thing that was asked for; `opposite` is what was not to be done, done."""


@dataclass(frozen=True, slots=True)
class WishPart:
    """A thing asked for and what became of it.

    Attributes:
        result: What became of it.
        words: In plain words, as it was understood: `change to the left lane`; empty where the plan alone names it.
        why: What is missing, or why it was not compared; empty where it was done.
    """

    result: PartResult
    words: str = ""
    why: str = ""


@dataclass(frozen=True, slots=True)
class Causes:
    """Why a trip went as it did, apart from its outcome; each flag is counted over all planned trips.

    Attributes:
        policy_failed: The program was rejected by the gate or died while running.
        infra_failed: Endpoint, sandbox or machine failed; says nothing about the policy.
        refused: Planner or checks declined the wish.
        fallback_used: The autopilot drove on without the program at some point before the end.
        detail: In words.
    """

    policy_failed: bool = False
    infra_failed: bool = False
    refused: bool = False
    fallback_used: bool = False
    detail: str = ""


@dataclass(frozen=True, slots=True)
class Metric:
    """A number that may not apply: not applicable is not zero.

    Attributes:
        id: Versioned id, e.g. `lampilot-ttc-v1`.
        value: The value; meaningless when not `applies`.
        unit: SI unit or `points`.
        applies: Whether the metric makes sense for this trip.
    """

    id: str
    value: float
    unit: str
    applies: bool = True


@dataclass(frozen=True, slots=True)
class Trip:
    """What happened: from the words to the last metre.

    Attributes:
        id: Content hash of everything that decided the trip.
        instruction, context, history, plan, verdicts: The loop's values.
        outcome: What happened.
        causes: Why.
        metrics: Scores, each with its versioned id.
        duration_s: Simulated time driven.
        scenario: Id of the scenario.
        seed: Its seed.
        said: What the program told the passenger, as (time s, text).
        record: Provenance: versions, hashes, planner and model ids.
        unused: Parts of the wish, as said, that the plan does not use: places, conditions, further acts.
        parts: The things asked for and what became of each, in their order; empty where nothing was judged.
        judged_by: Source of what the drive was judged by; empty where nothing was judged.
    """

    id: str
    instruction: Instruction
    context: Context
    history: History
    plan: Plan
    verdicts: tuple[Verdict, ...]
    outcome: Outcome
    causes: Causes
    metrics: tuple[Metric, ...]
    duration_s: float
    scenario: str
    seed: int
    said: tuple[tuple[float, str], ...] = ()
    record: tuple[tuple[str, Any], ...] = ()
    unused: tuple[str, ...] = ()
    parts: tuple[WishPart, ...] = ()
    judged_by: JudgedBy | Literal[""] = ""

    @property
    def summary(self) -> str:
        """Wish, planner, scenario and seconds in one short line."""
        wish, planner, scenario = (
            text if len(text) <= most else f"{text[: most - 1]}…"
            for text, most in ((repr(self.instruction.text), 80), (self.plan.planner, 30), (self.scenario, 30))
        )
        return f"{wish} by {planner} in {scenario}, {self.duration_s:.1f} s"

    def __repr__(self) -> str:
        """One line: a trip holds the whole conversation."""
        return f"<Trip {self.outcome}: {self.summary}>"
