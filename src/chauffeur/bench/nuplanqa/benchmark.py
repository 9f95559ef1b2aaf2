"""NuPlanQA for the kernel: a vision-language model answers, the letter it chose is read, and the blind baseline's
guess stands in every row beside it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final, Literal, cast, get_args

from chauffeur.bench.kernel.benchmark import BenchJob, ItemOutcome, RequestDesk
from chauffeur.bench.kernel.calls import Request
from chauffeur.bench.kernel.headline import CardPart, Headline
from chauffeur.bench.kernel.metrics import AnyRow, TableSpec, count, share
from chauffeur.bench.kernel.store import Row
from chauffeur.bench.nuplanqa.blind import BASELINE, blind_guesses
from chauffeur.bench.nuplanqa.choice import EXTRACTION, read_choice
from chauffeur.bench.nuplanqa.frames import CAMERAS, FRAMES, UNTOLD, FramePath, FrameSource
from chauffeur.bench.nuplanqa.metadata import find_metadata, load_metadata
from chauffeur.bench.nuplanqa.questions import LETTERS, SKILL_OF, SKILLS, SUBTASKS, VqaFile, VqaItem, load_questions
from chauffeur.bench.nuplanqa.table6 import TABLE_VI
from chauffeur.bench.pictures import CORRUPT, MISSING, Pictures, data_uri, read_picture
from chauffeur.concept import ConfigError, DataError
from chauffeur.planners.prompts import Message

ASKING: Final = "ask-v1"
"""Id of the wording below; figures belong to it."""

Control = Literal["pictures", "blank", "text"]
"""Pictures shown to a model: the real ones; grey ones of the same size; none at all."""

_ASK: Final = "Answer with the letter of the right option, (a), (b), (c) or (d), and nothing else."


def conversation(item: VqaItem, frames: Sequence[FramePath], control: Control, side_px: int) -> list[Message]:
    """Messages to the model.

    Args:
        item: The question.
        frames: Its pictures, oldest first; none for `text`.
        control: What it is shown.
        side_px: Longer side that pictures are scaled down to; 0 leaves them.

    Raises:
        DataError: A picture is missing or damaged.
    """
    asked = f"{item.text()}\n\n{_ASK}"
    if control == "text":
        return [{"role": "user", "content": asked}]
    kind: Pictures = "blank" if control == "blank" else "real"
    parts: list[dict[str, Any]] = []
    for frame in frames:
        parts.append({"type": "text", "text": f"{frame.caption}:"})
        picture = data_uri(read_picture(frame.path, side_px, kind))
        parts.append({"type": "image_url", "image_url": {"url": picture}})
    parts.append({"type": "text", "text": asked})
    return [cast("Message", {"role": "user", "content": parts})]


BENCH_VERSION: Final = "nuplanqa-v1"

Status = Literal[
    "answered", "no choice", "no answer", "no vision", "missing view", "corrupt image", "no metadata", "unknown subtask"
]
"""Outcome of a question. `answered` and `no choice` count in the accuracy, the others are counted apart."""

UNKNOWN_SUBTASK: Final = "Unknown subtask"
_BEGINNINGS: Final[Mapping[str, Status]] = {
    MISSING: "missing view",
    CORRUPT: "corrupt image",
    UNTOLD: "no metadata",
    UNKNOWN_SUBTASK: "unknown subtask",
}
_NO_VISION: Final = "takes no pictures"
"""In the words of `planners.llm_errors` for an endpoint whose model reads text alone."""


@dataclass(frozen=True, slots=True)
class VqaRow:
    """One question and what became of it.

    Attributes:
        question: Id of the question; its circular shifts have one.
        token: Sample.
        chain: Scene: rows of one hang together.
        subtask, skill: What it asks about; of an unknown subtask the skill is empty.
        scene: Kind of scene, as the metadata say; `not told` where they do not.
        control: What the model was shown.
        frames: Instants shown, at most.
        shift: Places by which the options were moved in a circle.
        status: What became of it.
        detail: Why, where it was not answered; how a choice was read, or why none was, where it was.
        right: Letter of the right option.
        chosen: Letter chosen; empty for none.
        correct: Whether it is the right one; None where it was not answered.
        blind: Whether the blind baseline guesses it; None for a set too small for one.
        answer: The model's words.
    """

    question: str
    token: str
    chain: str
    subtask: str
    skill: str
    scene: str
    control: str
    frames: int
    shift: int
    status: Status
    detail: str
    right: str
    chosen: str
    correct: bool | None
    blind: bool | None
    answer: str


@dataclass(frozen=True, slots=True)
class AskedItem:
    """A question with its options moved on so many places."""

    id: str
    asked: VqaItem
    question: str
    shift: int


def _answered(row: AnyRow) -> bool:
    return row["correct"] is not None


_ACCURACY: Final = share("nuplanqa-accuracy-v1", "accuracy", lambda row: row["correct"], better="higher")
_BLIND: Final = share(
    "nuplanqa-blind-v1", "blind baseline", lambda row: row["blind"] if row["correct"] is not None else None
)
_CHOSEN: Final = tuple(
    share(
        f"nuplanqa-chose-{letter}-v1",
        f"chose ({letter})",
        lambda row, letter=letter: row["chosen"] == letter if _answered(row) else None,
    )
    for letter in LETTERS
)
_STATUS: Final = count("nuplanqa-status-v1", "questions", lambda row: bool(row["status"]))


def _table(title: str, group: str, order: Sequence[str], head: str) -> TableSpec:
    return TableSpec(
        title, (_ACCURACY, _BLIND), group, tuple(order), cluster="chain", rows=_answered, heads=(head, "answers")
    )


class NuPlanQaBenchmark:
    """Questions of NuPlanQA's format about pictures of a road."""

    id = BENCH_VERSION
    asks: Literal["words"] = "words"
    row = VqaRow
    tables = (
        _table("By skill", "skill", tuple(SKILLS), "skill"),
        _table("By subtask", "subtask", SUBTASKS, "subtask"),
        _table("By kind of scene", "scene", (), "scene"),
        TableSpec(
            "By place of the right option",
            (_ACCURACY, *_CHOSEN),
            "right",
            tuple(LETTERS),
            cluster="chain",
            rows=_answered,
            heads=("right", "answers"),
        ),
        TableSpec("What became of the questions", (_STATUS,), "status", get_args(Status), heads=("status", "rows")),
        TABLE_VI,
    )
    judge = "The letter of the right option, as the file of questions has it. Shared: nothing, where it is NuPlanQA's; \
questions about our own scenes are written by the generator that also makes the training data."

    card = CardPart(
        (
            Headline("accuracy", TABLE_VI, TABLE_VI.measures[-1], "the model", paper=("GPT-4o", "BEV-LLM")),
            Headline("blind baseline", TABLE_VI, TABLE_VI.measures[-1], "blind baseline: words of the options alone"),
        ),
        evidence="questions about pictures; real where the file is NuPlanQA's, rendered where it is ours",
        quick={"limit": 200},
    )

    @property
    def variant(self) -> str:
        """Options as the default run folder's name shows them."""
        return "" if self._control == "pictures" else self._control

    def conclude(self, folder: Path, rows: Sequence[Row], results: Mapping[str, Row | None]) -> Sequence[str]:
        """See Concludes."""
        del folder, results
        said = [f"Left out: {what}" for what in self.unreadable]
        if self._control != "text":
            missing = self.frames.missing([one.token for one in self.questions if one.token in self.frames.metadata])
            if missing:
                said.append(f"{len(missing):,} pictures are not there, the first {missing[0]}.")
        if any(str(row["scene"]).startswith("simulated") for row in rows):
            said.append("The pictures are rendered and the questions generated: simulated, not nuPlan's.")
        return said

    def __init__(
        self,
        data: str,
        images: str = "",
        metadata: str = "",
        control: Control = "pictures",
        frames: str | int = "multi",
        cameras: str = ",".join(CAMERAS),
        shifts: str | int = 0,
        side: int = 448,
        limit: int = 0,
    ) -> None:
        """Make it.

        Args:
            data: File of questions, or a folder with `questions.json`.
            images: Folder below which the metadata's paths lie; default beside the questions.
            metadata: File of metadata; default one of the usual names beside the questions.
            control: `pictures`, `blank` (grey ones) or `text` (none).
            frames: `multi` (the last 1.5 s), `single`, or a number of samples.
            cameras: Which cameras, separated by commas.
            shifts: By how many places the options are moved on in a circle; `all` asks every question four times.
            side: Longer side in px that pictures are scaled down to; 0 leaves them.
            limit: Only the first so many questions; 0 for all.

        Raises:
            ConfigError: An option makes no sense.
            DataError: Questions or metadata cannot be read.
        """
        if control not in get_args(Control):
            raise ConfigError(f"There is no control {control!r}.", hint=f"Choose of: {', '.join(get_args(Control))}.")
        self._control: Control = control
        self._count = {"multi": FRAMES, "single": 1}.get(str(frames)) or _number("frames", frames, 1, 20)
        self._shifts = tuple(range(4)) if shifts == "all" else (_number("shifts", shifts, 0, 3),)
        self._side = side
        path = Path(data)
        self._path = path / "questions.json" if path.is_dir() else path
        self._file: VqaFile = load_questions(self._path)
        self._items = self._file.items[: limit or None]
        found = Path(metadata) if metadata else find_metadata(self._path.parent)
        if found is None and control != "text":
            raise DataError(
                f"There are no metadata beside {self._path}: which pictures belong to a question is not known.",
                hint="Name them with metadata=FILE, or ask without pictures: control=text.",
            )
        self.frames = FrameSource(
            Path(images) if images else self._path.parent,
            {} if found is None else load_metadata(found),
            tuple(name.strip() for name in cameras.split(",") if name.strip()),
            self._count,
        )
        self.config: Mapping[str, Any] = {
            "data_sha256": self._file.sha256,
            "data": self._path.name,
            "unreadable": len(self._file.unreadable),
            "control": control,
            "frames": self._count,
            "cameras": list(self.frames.cameras),
            "shifts": list(self._shifts),
            "side_px": side,
            "limit": limit,
            "asking": ASKING,
            "extraction": EXTRACTION,
            "baseline": BASELINE,
        }

    @property
    def questions(self) -> tuple[VqaItem, ...]:
        """The questions, unshifted."""
        return self._items

    @property
    def unreadable(self) -> Iterator[str]:
        """Entries of the file that are no questions, in words."""
        return (f"entry {one.place}: {one.why}" for one in self._file.unreadable)

    @cached_property
    def _blind(self) -> Mapping[str, bool]:
        """Hits of the blind baseline by question id; empty for a set too small."""
        guesses = blind_guesses(self._items)
        if guesses is None:
            return {}
        return {item.id: guess == item.answer for item, guess in zip(self._items, guesses, strict=True)}

    def items(self) -> Sequence[AskedItem]:
        found: list[AskedItem] = []
        for item in self._items:
            for places in self._shifts:
                asked = item.shifted(places)
                found.append(AskedItem(asked.id, asked, item.id, places))
        return found

    async def request(self, item: AskedItem, desk: RequestDesk) -> Request:
        """See Benchmark. Raises DataError: a picture is missing or damaged, or the subtask is unknown."""
        del desk
        one = item.asked
        if one.subtask not in SKILL_OF:
            raise DataError(f"{UNKNOWN_SUBTASK} {one.subtask!r}.", hint=f"NuPlanQA has: {', '.join(SUBTASKS)}.")
        frames = () if self._control == "text" else self.frames.paths(one.token)
        return conversation(one, frames, self._control, self._side)

    def job(self, item: AskedItem, answer: Row | None) -> BenchJob | None:
        """See Benchmark: the answer itself is the result."""
        del item, answer

    def rows(self, outcome: ItemOutcome[AskedItem]) -> Sequence[VqaRow]:
        if outcome.answer is None and not outcome.error:
            return ()
        item, one = outcome.item, outcome.item.asked
        words = "" if outcome.answer is None else str(outcome.answer["text"])
        status, detail, chosen = self._read(one, outcome, words)
        counts = status in {"answered", "no choice"}
        row = VqaRow(
            question=item.question,
            token=one.token,
            chain=one.chain,
            subtask=one.subtask,
            skill=SKILL_OF.get(one.subtask, ""),
            scene=self.frames.scene_type(one.token) or "not told",
            control=self._control,
            frames=0 if self._control == "text" else self._count,
            shift=item.shift,
            status=status,
            detail=detail,
            right=one.letter,
            chosen=chosen,
            correct=chosen == one.letter if counts else None,
            blind=self._blind.get(item.question),
            answer=words,
        )
        return (row,)

    def _read(self, item: VqaItem, outcome: ItemOutcome[AskedItem], words: str) -> tuple[Status, str, str]:
        if outcome.answer is None:
            for beginning, status in _BEGINNINGS.items():
                if outcome.error.startswith(beginning):
                    return status, outcome.error, ""
            if _NO_VISION in outcome.error:
                return "no vision", outcome.error, ""
            return "no answer", outcome.error, ""
        choice = read_choice(words, item.options)
        if choice.index is None:
            return "no choice", choice.how, ""
        return "answered", choice.how, LETTERS[choice.index]


def _number(name: str, value: str | int, least: int, most: int) -> int:
    try:
        number = int(value)
    except ValueError:
        number = least - 1
    if not least <= number <= most:
        raise ConfigError(f"{name}={value} makes no sense.", hint=f"Give a number from {least} to {most}.")
    return number
