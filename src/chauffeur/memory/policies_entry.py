"""One entry of a policy repository: a program that did well, what it does, and where that was learned.

A repository may come from anybody, so an entry is believed only after `read_entry`: sizes, types and names are bounded,
its id has to match its content, and its program has to pass the static gate as one top-level function of its own name.
"""

from __future__ import annotations

import hashlib
import json
import keyword
import re
from dataclasses import asdict, dataclass
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, StringConstraints, TypeAdapter, ValidationError

from chauffeur.concept import DataError
from chauffeur.programs.catalogue import apis_of, vocabulary_of
from chauffeur.programs.errors import ProgramSyntaxError
from chauffeur.programs.gate import check_source
from chauffeur.programs.library import standalone
from chauffeur.programs.rewrite import MAX_SOURCE_CHARS
from chauffeur.programs.words import BUILTINS

SCHEMA = "chauffeur-policy-v1"

Judge = Literal["person", "evaluator"]
"""Who said that the program did well."""

Describer = Literal["model", "person", "fallback"]
"""Who wrote the description; `fallback` is wording of ours, where a model gave nothing usable."""

MAX_DESCRIPTION_CHARS = 1_000
_Line = Annotated[str, StringConstraints(max_length=300)]
_Text = Annotated[str, StringConstraints(max_length=4_000)]

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,59}")
_FALLBACK_NAME = "program"
_SCORE = "lampilot-score"


@dataclass(frozen=True, slots=True)
class PolicyEntry:
    """A program of the repository.

    Attributes:
        id: Hash of what was learned where (`content_id`).
        name: Name of its function.
        version: 1, 2, ...: entries that came with the same name.
        description: What it does, in words.
        described_by: Whose words.
        source: The program: one top-level function `name` without parameters, needing nothing beside it.
        command: The wish it was learned from.
        context: The situation then, in words.
        world: Kind of road: `highway`, `intersection`, `town`.
        scenario, item: Where it was learned.
        outcome: What the drive came to.
        metrics: Numbers of that drive, as (versioned id, value).
        judged_by: Who said that it did well.
        critiques: What was said of the attempts before it, oldest first.
        planner, model: Who wrote it.
        learned: When, ISO 8601 UTC.
        chauffeur: Version it was learned with.
        received: Where it came from, when it was not learned here.
    """

    __pydantic_config__ = ConfigDict(extra="forbid", strict=False)

    id: Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{16}$")]
    name: Annotated[str, StringConstraints(max_length=60)]
    version: Annotated[int, Field(ge=1, le=10_000)]
    description: Annotated[str, StringConstraints(max_length=MAX_DESCRIPTION_CHARS)]
    described_by: Describer
    source: Annotated[str, StringConstraints(max_length=MAX_SOURCE_CHARS)]
    command: _Text
    context: _Text
    world: _Line
    scenario: _Line
    item: _Line
    outcome: _Line
    metrics: Annotated[tuple[tuple[_Line, float], ...], Field(max_length=50)]
    judged_by: Judge
    critiques: Annotated[tuple[_Text, ...], Field(max_length=50)]
    planner: _Line
    model: _Line
    learned: _Line
    chauffeur: _Line
    received: _Line = ""

    @property
    def callable_name(self) -> str:
        """How programs call it: its name, and from the second version on the version."""
        return self.name if self.version == 1 else f"{self.name}V{self.version}"

    @property
    def score(self) -> float | None:
        """Points of the drive it was learned from; None where it was not scored."""
        return next((value for metric, value in self.metrics if metric.startswith(_SCORE)), None)

    @property
    def callable_source(self) -> str:
        """The program under that name."""
        return self.source if self.version == 1 else standalone(self.source, self.callable_name)


_adapter: TypeAdapter[PolicyEntry] = TypeAdapter(PolicyEntry)


def content_id(
    source: str, command: str, context: str, scenario: str, judged_by: Judge, planner: str, model: str
) -> str:
    """What makes two entries the same: one program, learned in one place, from one model, by one judge."""
    parts = [SCHEMA, source, command, context, scenario, judged_by, planner, model]
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:16]


def fitting_name(name: str, world: str = "") -> str:
    """The name, or a plain one where a program by that name could not be offered on that kind of road."""
    return name if _name_problem(name, world) == "" else _FALLBACK_NAME


def write_entry(entry: PolicyEntry) -> bytes:
    """An entry as a line of JSON. ASCII only, so that any text survives any tool on the way."""
    return json.dumps({"schema": SCHEMA, **asdict(entry)}, allow_nan=False).encode("ascii") + b"\n"


def read_entry(line: bytes) -> PolicyEntry:
    """An entry from a line that anybody may have written.

    Raises:
        DataError: Why it is not believed.
    """
    try:
        fields: Any = json.loads(line, parse_constant=_refuse_constant)
        if not isinstance(fields, dict) or fields.pop("schema", None) != SCHEMA:
            raise DataError(f"It is not an entry of the form {SCHEMA}.")
        entry = _adapter.validate_python(fields)
        json.dumps(asdict(entry), ensure_ascii=False).encode()  # lone surrogates are legal JSON and no text
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        raise DataError(f"Its field {'.'.join(str(part) for part in first['loc'])} is wrong: {first['msg']}.") from None
    except (ValueError, RecursionError) as error:
        raise DataError(f"It is not JSON: {type(error).__name__}.") from None
    problem = _problem(entry)
    if problem:
        raise DataError(problem)
    return entry


def _program_problem(entry: PolicyEntry) -> str:
    """Why an entry's program may not be offered; empty when it may."""
    vocabulary = vocabulary_of(entry.world)
    problem = _name_problem(entry.name, entry.world)
    if problem:
        return problem
    report = check_source(entry.source, vocabulary=vocabulary)
    if not report.passed:
        return f"The static gate refuses its program: {report.errors[0]}."
    try:
        offered, alone = entry.callable_source, standalone(entry.source, entry.name)
    except ProgramSyntaxError as error:
        return f"Its program cannot be read: {error}"
    if alone.strip() != entry.source.strip():
        return f"Its program is not one function {entry.name} that stands by itself."
    report = check_source(f"def beside_it():\n    yield from {entry.callable_name}()\n", offered, vocabulary)
    if not report.passed:
        return f"Its program cannot be called as {entry.callable_name}: {report.errors[0]}."
    return ""


def _problem(entry: PolicyEntry) -> str:
    known = content_id(
        entry.source, entry.command, entry.context, entry.scenario, entry.judged_by, entry.planner, entry.model
    )
    if entry.id != known:
        return "Its id does not match its content: it was changed by hand, or damaged."
    return _program_problem(entry)


def _name_problem(name: str, world: str) -> str:
    if not _NAME.fullmatch(name) or keyword.iskeyword(name):
        return f"The name {name[:60]!r} is not a plain function name."
    if name in apis_of(vocabulary_of(world)) or name in BUILTINS or name == "math":
        return f"The name {name} belongs to the driving language."
    return ""


def _refuse_constant(text: str) -> float:
    raise ValueError(text)
