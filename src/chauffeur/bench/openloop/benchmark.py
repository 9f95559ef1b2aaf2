"""Open-loop planning for the kernel: a model is asked for waypoints, and what the car really did is the measure.

Open loop means that nothing follows from an answer: the next picture comes whatever was said. Such figures say how a
model imitates a log, not how it drives, and a car's own motion tells most of a log. So constant velocity stands in
every row beside the model.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, make_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, cast, get_args

import numpy as np

from chauffeur.bench.kernel.benchmark import BenchJob, ItemOutcome, RequestDesk
from chauffeur.bench.kernel.calls import Request
from chauffeur.bench.kernel.headline import CardPart, Headline
from chauffeur.bench.kernel.metrics import AnyRow, Measure, TableSpec, mean, share
from chauffeur.bench.kernel.store import Row
from chauffeur.bench.openloop.conventions import (
    Convention,
    L2Errors,
    averaged,
    distances,
    fails,
    known,
    lagging,
    standing,
)
from chauffeur.bench.openloop.extrapolation import constant_velocity
from chauffeur.bench.openloop.nuscenes import NuScenesTables, PlanningSample
from chauffeur.bench.openloop.requests import ASKING, THOUGHTS, OpenLoopSetting, Shown, opening, question
from chauffeur.concept import ConfigError, DataError
from chauffeur.foreign.waypoints import FUTURE, READING, read_waypoints
from chauffeur.planners.base import Prose
from chauffeur.planners.prompts.waypoints import with_wish

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from chauffeur.planners.prompts import Message

    FloatArray = NDArray[np.float64]

BENCH: Final = "openloop-v2"
OpenLoopStatus = Literal["answered", "unreadable", "no answer"]
_AWAY: Final = tuple(f"l2_{5 * (i + 1):02}" for i in range(FUTURE))
"""Columns: distance of each waypoint, named by tenths of seconds."""
_LAGGED: Final = tuple(f"lagged_{5 * (i + 1):02}" for i in range(FUTURE))
"""Columns: distance of each true waypoint from the predicted position half a second before it (`conventions`)."""


Whose = Literal["l2", "cv"]


def _column(name: str, whose: Whose) -> str:
    """A column of the model's, or the same one of constant velocity."""
    if whose == "l2":
        return name
    return name.replace("l2", "cv") if name.startswith("l2") else f"cv_{name}"


OpenLoopRow: Final[type] = make_dataclass(
    "OpenLoopRow",
    [
        *((name, str) for name in ("item", "scene", "kind", "place", "setting", "shown")),
        ("status", OpenLoopStatus),
        ("detail", str),
        ("failed", bool | None),
        *((name, float | None) for name in (*_AWAY, *_LAGGED)),
        ("cv_failed", bool),
        *((_column(name, "cv"), float | None) for name in (*_AWAY, *_LAGGED)),
        ("answer", str),
    ],
    frozen=True,
)
"""One frame.

item: Token of the sample.
scene: Frames of one hang together.
kind, place: Of our own sets: what happens next, and where; otherwise empty.
setting, shown: How it was asked, and whether the picture was the real one.
status: What became of it; `no answer` counts nowhere.
detail: Why there is none.
failed: More than 10 m off within the first second, or unreadable; None without an answer.
l2_05 ... l2_30: Distance of each waypoint from the true one, m; of an unreadable answer those of a car that stays; None
    where the log had ended.
lagged_05 ... lagged_30: Distance of each true waypoint from the position predicted for half a second earlier, m: what
    OpenEMMA's published code compares at 2 and 3 s.
cv_05 ... cv_30, cv_lagged_05 ... cv_lagged_30, cv_failed: The same of constant velocity.
answer: The model's words.
"""


def errors_of(row: AnyRow, convention: Convention, whose: Whose = "l2") -> L2Errors:
    """The columns of a convention out of a stored row: of the model, or of constant velocity."""
    if failed_of(row, whose) is None:
        return L2Errors(None, None, None)
    return averaged(
        [row[_column(name, whose)] for name in _AWAY], [row[_column(name, whose)] for name in _LAGGED], convention
    )


def failed_of(row: AnyRow, whose: Whose = "l2") -> bool | None:
    """True if a stored row is a failure; None without an answer."""
    return row["failed" if whose == "l2" else "cv_failed"]


def _measures(convention: Convention, *, failures: bool) -> tuple[Measure, ...]:
    def of(row: AnyRow, name: str) -> float | None:
        if row["failed"] is None or (row["failed"] and not failures):
            return None
        return getattr(errors_of(row, convention), name)

    tail = "all" if failures else "kept"
    return tuple(
        mean(f"openloop-{convention}-{tail}-{short}-v2", f"L2 {short}", "m", lambda row, name=name: of(row, name), 2)
        for name, short in (("at_1s", "1s"), ("at_2s", "2s"), ("at_3s", "3s"), ("average", "avg"))
    )


FAILURE: Final = share("openloop-failure-v1", "failure rate", lambda row: row["failed"], 2)
UNREADABLE: Final = share(
    "openloop-unreadable-v1",
    "no waypoints",
    lambda row: None if row["failed"] is None else row["status"] == "unreadable",
    2,
)
_TITLES: Final[Mapping[Convention, str]] = {
    "openemma-code": "openemma-code: OpenEMMA's published lines, a step late at 2 and 3 s (the paper's Tab. XII)",
    "openemma": "openemma: OpenEMMA's means up to the second, each waypoint at its own time",
    "stp3": "stp3: ST-P3's and VAD's means up to the second",
    "uniad": "uniad: at the second, where it is known",
    "uniad-published": "uniad-published: at the second, what is not known as 0, divided by all samples",
}


_TABLES: Final[tuple[tuple[Convention, bool], ...]] = (
    ("openemma-code", False),
    ("openemma-code", True),
    ("openemma", False),
    ("stp3", True),
    ("uniad", False),
    ("uniad", True),
    ("uniad-published", False),
    ("uniad-published", True),
)
"""(averaging, failures counted) of each table; `openemma` and `stp3` are the same frame by frame and share a pair."""


def _tables() -> tuple[TableSpec, ...]:
    found: list[TableSpec] = []
    for convention, failures in _TABLES:
        what = "failures counted" if failures else "failures left out"
        measures = (*_measures(convention, failures=failures), FAILURE, UNREADABLE)
        title = f"{_TITLES[convention]}, {what}"
        found.append(TableSpec(title, measures, "kind", cluster="scene", heads=("next", "frames")))
    return (*found, TABLE_XII)


_AVERAGINGS: Final[tuple[Convention, ...]] = ("openemma-code", "openemma")


def _lines(rows: Sequence[AnyRow]) -> list[AnyRow]:
    """A row under either averaging, once for the model and once for constant velocity."""
    found: list[AnyRow] = []
    methods: tuple[tuple[Whose, str], ...] = (("l2", ""), ("cv", "constant velocity, "))
    for whose, name in methods:
        for row in rows:
            if (failed := failed_of(row, whose)) is not None:
                for averaging in _AVERAGINGS:
                    errors = None if failed else errors_of(row, averaging, whose)
                    found.append({**row, "line": f"{name}{averaging}", "errors": errors, "broken": failed})
    return found


def _printed(part: str, title: str) -> Measure:
    def of(row: AnyRow) -> float | None:
        return None if row["errors"] is None else getattr(row["errors"], part)

    return mean(f"openloop-table12-{part.replace('_', '-')}-v1", title, "m", of, 2, "lower")


TABLE_XII: Final = TableSpec(
    "As the paper's Tab. XII, failures left out of the means",
    (
        *(
            _printed(part, title)
            for part, title in (("at_1s", "L2 1 s"), ("at_2s", "L2 2 s"), ("at_3s", "L2 3 s"), ("average", "avg."))
        ),
        share("openloop-table12-failures-v1", "failures", lambda row: bool(row["broken"]), 2, "lower"),
    ),
    "line",
    cluster="scene",
    heads=("averaging", "frames"),
    total=False,
    over=_lines,
    published="openloop/table12.json",
    brackets=False,
    lead="The paper follows OpenEMMA; whether its rows come out of the lines that OpenEMMA published (`openemma-code`, "
    "a step late at 2 and 3 s) is nowhere said, so each method has a line of either averaging.",
)


def distance_columns(predicted: FloatArray | None, truth: FloatArray, whose: Whose = "l2") -> dict[str, Any]:
    """Columns of a prediction (6, 2); None for an unreadable one."""
    found = standing() if predicted is None else predicted
    names = [_column(name, whose) for name in (*_AWAY, *_LAGGED)]
    values = known(np.concatenate([distances(found, truth), lagging(found, truth)]))
    columns: dict[str, Any] = {
        name: None if value is None else round(value, 4) for name, value in zip(names, values, strict=True)
    }
    columns["failed" if whose == "l2" else "cv_failed"] = fails(predicted, truth)
    return columns


@dataclass(frozen=True, slots=True)
class OpenLoopItem:
    """A frame that is asked about, and what the passenger says there; empty for nothing."""

    id: str
    sample: PlanningSample
    instruction: str = ""


class OpenLoopBenchmark:
    """Frames of nuScenes, or of a set in its format."""

    id = BENCH
    asks: Literal["words"] = "words"
    row: type = OpenLoopRow
    tables = _tables()
    judge = (
        "Distances to the positions that were driven. Shared: nothing; commands are read off the true future, as ST-P3 "
        "and UniAD do, which no car would have."
    )
    card = CardPart(
        (
            Headline("L2, mean of three seconds", TABLE_XII, TABLE_XII.measures[3], "openemma-code",
                     paper=("ViLaD-Zero, Zero-Shot",)),
            Headline("constant velocity, the same", TABLE_XII, TABLE_XII.measures[3],
                     "constant velocity, openemma-code"),
        ),
        evidence="recorded or rendered frames; nothing is driven",
        quick={"limit": 200},
    )  # fmt: skip
    steps = FUTURE
    """Waypoints asked for."""

    def __init__(
        self,
        data: str,
        tables: str = "",
        setting: OpenLoopSetting = "zero-shot",
        shown: Shown = "pictures",
        scene_list: str = "",
        side_px: int = 448,
        limit: int = 0,
        stride: int = 1,
    ) -> None:
        """Make it.

        Args:
            data: Folder that holds the version's folder of tables, and `samples`.
            tables: E.g. `v1.0-mini`; default the only ones there, or `v1.0-test` of a set of ours.
            setting: `zero-shot`, `chain-of-thought` or `sft`.
            shown: `pictures`, or `blank` (grey ones).
            scene_list: File with names of scenes, one a line: nuScenes' own splits are lists of names. Default all.
            side_px: Longer side in px that pictures are scaled down to; 0 leaves them.
            limit: Only the first so many frames; 0 for all.
            stride: Only every so many-th frame.

        Raises:
            ConfigError: An option makes no sense.
            DataError: Tables cannot be read, or hold no frame that can be asked about.
        """
        if setting not in get_args(OpenLoopSetting):
            known = ", ".join(get_args(OpenLoopSetting))
            raise ConfigError(f"There is no setting {setting!r}.", hint=f"Choose of: {known}.")
        if shown not in get_args(Shown):
            raise ConfigError(f"Nothing is shown as {shown!r}.", hint="Choose pictures or blank.")
        if stride < 1 or limit < 0:
            raise ConfigError(
                f"stride={stride} and limit={limit} make no sense.", hint="Give 1 or more, and 0 or more."
            )
        self._setting: OpenLoopSetting = setting
        self._shown: Shown = shown
        self._side = side_px
        root = Path(data)
        self.tables_read = NuScenesTables(root, tables or _only_version(root))
        names, digest = _names(scene_list)
        self.samples = self.asked_about(self.tables_read.samples(names, self.steps))[::stride][: limit or None]
        if not self.samples:
            raise DataError(f"{self.tables_read.folder} has no frame with 2 s before it.")
        self.own = self.tables_read.marks is not None
        self.config: Mapping[str, Any] = {
            "data": root.name,
            "version": self.tables_read.folder.name,
            "data_sha256": self.tables_read.sha256,
            "scenes": digest,
            "setting": setting,
            "shown": shown,
            "side_px": side_px,
            "limit": limit,
            "every": stride,
            "command": "navigation" if self.own else "read off the true future, as ST-P3 and UniAD do",
            "asking": ASKING,
            "reading": READING,
        }

    @property
    def variant(self) -> str:
        """Options as the default run folder's name shows them."""
        return "-".join(one for one in (self._setting, self._shown) if one not in ("zero-shot", "pictures"))

    def conclude(self, folder: Path, rows: Sequence[Row], results: Mapping[str, Row | None]) -> Sequence[str]:
        """See Concludes."""
        del folder, rows, results
        if self.own:
            from chauffeur.bench.openloop.frames import (
                SIMULATED,  # with cameras, which a run on nuScenes has no need of
            )

            return (SIMULATED,)
        return ("Commands are read off the true future, as ST-P3 and UniAD do: no input a car would have.",)

    def asked_about(self, samples: Sequence[PlanningSample]) -> Sequence[PlanningSample]:
        """The samples that are asked about, of all that have 2 s before them."""
        return samples

    def items(self) -> Sequence[OpenLoopItem]:
        return [OpenLoopItem(one.id, one) for one in self.samples]

    async def request(self, item: OpenLoopItem, desk: RequestDesk) -> Request:
        """See Benchmark. Raises DataError: a picture is missing or damaged, or an earlier question got no answer."""
        asked = question(item.sample, self._setting, item.instruction)
        if self._setting != "chain-of-thought":
            return [opening(item.sample, asked, self._shown, self._side)]
        turns: list[Message] = [opening(item.sample, with_wish(THOUGHTS[0], item.instruction), self._shown, self._side)]
        for following in (*THOUGHTS[1:], asked):
            reply = await desk.ask(tuple(turns))
            if not isinstance(reply, Prose):
                raise DataError(f"No answer to {_last_text(turns)!r}.")
            turns.append(cast("Message", {"role": "assistant", "content": reply.text}))
            turns.append(cast("Message", {"role": "user", "content": following}))
        return turns

    def job(self, item: OpenLoopItem, answer: Row | None) -> BenchJob | None:
        """See Benchmark: the answer itself is the result."""
        del item, answer

    def rows(self, outcome: ItemOutcome[OpenLoopItem]) -> Sequence[Any]:
        if outcome.answer is None and not outcome.error:
            return ()
        sample = outcome.item.sample
        words, predicted, status = read_answer(outcome, FUTURE)
        own = distance_columns(predicted, sample.future)
        if status == "no answer":
            own = dict.fromkeys(own)
        columns: dict[str, Any] = {
            "item": sample.id,
            "scene": sample.scene,
            "kind": sample.kind,
            "place": sample.place,
            "setting": self._setting,
            "shown": self._shown,
            "status": status,
            "detail": outcome.error,
            **own,
            **distance_columns(constant_velocity(sample.history), sample.future, "cv"),
            "answer": words,
        }
        return (OpenLoopRow(**columns),)


def read_answer(outcome: ItemOutcome[OpenLoopItem], steps: int) -> tuple[str, FloatArray | None, OpenLoopStatus]:
    """An item's words, the waypoints (steps, 2) in them, and what became of it."""
    if outcome.answer is None:
        return "", None, "no answer"
    words = str(outcome.answer["text"])
    predicted = read_waypoints(words, steps)
    return words, predicted, "unreadable" if predicted is None else "answered"


def _last_text(turns: Sequence[Any]) -> str:
    content: Any = turns[-1]["content"]
    return content if isinstance(content, str) else str(content[-1]["text"])


def _only_version(root: Path) -> str:
    found = sorted(one.parent.name for one in root.glob("*/sample.json"))
    if "v1.0-test" in found and (root / "v1.0-test" / "openloop.json").is_file():
        return "v1.0-test"
    if len(found) != 1:
        there = ", ".join(found) or "none"
        raise DataError(f"{root} has not one version of nuScenes' tables (there: {there}).", hint="Name its tables.")
    return found[0]


def _names(path: str) -> tuple[frozenset[str] | None, str]:
    """Scenes of a file, and how a run tells them."""
    if not path:
        return None, "all"
    try:
        names = frozenset(Path(path).read_text(encoding="utf-8").split())
    except OSError as error:
        raise DataError(f"The list of scenes {path} cannot be read: {error.strerror}.") from error
    return names, f"{len(names)} of {Path(path).name}"
