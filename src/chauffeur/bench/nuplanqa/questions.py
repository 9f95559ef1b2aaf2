"""NuPlanQA's published question format, read and written.

A file is a JSON list of `{"sample_token", "QA": [{"q", "a"}], "task", "split", "prev"}`. `q` is a fixed preamble, five
samples of velocity and steering, the question, and options `(a)` to `(d)`; `a` is the right option with its letter.
Source: Park et al., "NuPlanQA", arXiv 2503.12772, and the published evaluation file.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, cast

from chauffeur.concept import DataError
from chauffeur.concept.data import parse_json

SKILLS: Final[Mapping[str, tuple[str, ...]]] = {
    "Road Environment Perception": ("Traffic Light", "Weather/Lighting Conditions", "Road Type/Conditions"),
    "Spatial Relations Recognition": ("Surrounding Objects", "Traffic Flow", "Key Objects"),
    "Ego-Centric Reasoning": ("Ego-Vehicle Maneuver", "Situation Assessment", "Action Recommendation"),
}
"""Skills and their subtasks, in the order of the paper's Tab. VI."""

SUBTASKS: Final = tuple(task for tasks in SKILLS.values() for task in tasks)
SKILL_OF: Final[Mapping[str, str]] = {task: skill for skill, tasks in SKILLS.items() for task in tasks}
LETTERS: Final = "abcd"
SAMPLES: Final = 5
"""Samples of velocity and of steering in a question."""

PREAMBLE: Final = (
    "You are driving on the road. Based on given images of the surroudings of your vehicle and information from your "
    "vehicle extracted past 1.5 seconds, choose right answer among (a) to (d) for the given question."
)
"""Word for word, its slip of the pen included: whatever was trained on the published questions has read it."""

_SIGNALS: Final = re.compile(r"-\s*(Velocity|Steering)[^\[\n]{0,200}\[([^\[\]]*)\]", re.IGNORECASE)
_OPTION: Final = re.compile(r"\(([a-d])\)\s{0,8}")
_ANSWER: Final = re.compile(r"\s{0,8}\(([a-d])\)")


@dataclass(frozen=True, slots=True)
class VqaItem:
    """One question with four options.

    Attributes:
        id: Unique in its file and the same for ever.
        token: Sample: names the instant and, with the metadata, its pictures.
        previous: Token of the sample before; empty where there is none.
        subtask: One of SUBTASKS, unless the file says otherwise.
        split: As the file says.
        preamble: What stands before the control signals.
        speeds_mps: Samples of the ego's speed, the last one now.
        steering_deg: Samples of the angle of its front wheels, degrees, as the file gives them.
        question: The question.
        options: Texts of (a) to (d).
        answer: Index of the right one.
        chain: Name of the scene: items of one chain of `prev` hang together.
    """

    id: str
    token: str
    previous: str
    subtask: str
    split: str
    preamble: str
    speeds_mps: tuple[float, ...]
    steering_deg: tuple[float, ...]
    question: str
    options: tuple[str, ...]
    answer: int
    chain: str = ""

    @property
    def letter(self) -> str:
        """Letter of the right option."""
        return LETTERS[self.answer]

    def shifted(self, places: int) -> VqaItem:
        """The same question with its options moved on so many places in a circle; same id for none."""
        if places % len(self.options) == 0:
            return self
        count = len(self.options)
        options = tuple(self.options[(index - places) % count] for index in range(count))
        return replace(self, id=f"{self.id}+{places % count}", options=options, answer=(self.answer + places) % count)

    def text(self) -> str:
        """`q`, as the published files have it."""
        listed = "\n".join(f"({letter}) {option}" for letter, option in zip(LETTERS, self.options, strict=True))
        return (
            f"{self.preamble}\n- Velocity(m/s): {list(self.speeds_mps)}\n- Steering angles: {list(self.steering_deg)}"
            f"\n\n Question:  {self.question}\n\n{listed}"
        )

    def json(self) -> dict[str, Any]:
        """The item as a published file has it."""
        right = f"({self.letter}) {self.options[self.answer]}"
        return {
            "sample_token": self.token,
            "QA": [{"q": self.text(), "a": right}],
            "task": self.subtask,
            "split": self.split,
            "prev": self.previous,
        }


@dataclass(frozen=True, slots=True)
class UnreadableItem:
    """An entry of a file that is no question, and why."""

    place: int
    why: str


@dataclass(frozen=True, slots=True)
class VqaFile:
    """Content of a file.

    Attributes:
        items: Its questions, in its order.
        unreadable: Its entries that are none.
        sha256: Of its bytes.
    """

    items: tuple[VqaItem, ...]
    unreadable: tuple[UnreadableItem, ...]
    sha256: str


def load_questions(path: Path) -> VqaFile:
    """Read a file of questions.

    Raises:
        DataError: There is none, it is no JSON list, or no entry of it is a question.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise DataError(
            f"Cannot read the questions {path}: {error.strerror}.",
            hint="NuPlanQA's evaluation file is nuplanqa_eval_test.json; for simulated ones: chauffeur bench scenes qa",
        ) from error
    if content.startswith(b"version https://git-lfs"):
        raise DataError(f"{path} is a pointer of Git LFS, not the file.", hint="Fetch it: git lfs pull")
    try:
        entries = parse_json(content)
    except ValueError as error:
        raise DataError(f"{path} is no JSON: {error}.") from error
    if not isinstance(entries, list):
        raise DataError(f"{path} is no list of questions.", hint="It should begin with '['.")
    items: list[VqaItem] = []
    unreadable: list[UnreadableItem] = []
    for place, entry in enumerate(cast("list[Any]", entries)):
        try:
            items.append(_item(entry, place))
        except (ValueError, KeyError, TypeError, IndexError) as error:
            unreadable.append(UnreadableItem(place, f"{type(error).__name__}: {error}"))
    if not items:
        why = unreadable[0].why if unreadable else "it is empty"
        raise DataError(f"{path} has no question that can be read ({why}).")
    return VqaFile(_chained(items), tuple(unreadable), hashlib.sha256(content).hexdigest())


@dataclass(frozen=True, slots=True)
class ReadQuestion:
    """A `q` taken apart; attributes as in VqaItem."""

    preamble: str
    speeds_mps: tuple[float, ...]
    steering_deg: tuple[float, ...]
    question: str
    options: tuple[str, ...]


def read_question(asked: str) -> ReadQuestion:
    """Take a `q` apart. Raises ValueError: it has no four options at its end."""
    start = asked.rindex("(a)")  # some questions hold a list of options of their own: theirs is the last
    head, tail = asked[:start], asked[start:]
    parts = _OPTION.split(tail)[1:]
    found = {letter: text.strip() for letter, text in zip(parts[::2], parts[1::2], strict=True)}
    if "".join(found) != LETTERS or len(parts) != 2 * len(LETTERS):
        raise ValueError(f"options {parts[::2]} instead of (a) to (d)")
    signals = list(_SIGNALS.finditer(head))
    samples = {match.group(1).lower(): _numbers(match.group(2)) for match in signals}
    question = head[signals[-1].end() :] if signals else head
    return ReadQuestion(
        preamble=head[: signals[0].start()].strip() if signals else PREAMBLE,
        speeds_mps=samples.get("velocity", ()),
        steering_deg=samples.get("steering", ()),
        question=re.sub(r"^\s*Question:\s*", "", question).strip(),
        options=tuple(found[letter] for letter in LETTERS),
    )


def _item(entry: Any, place: int) -> VqaItem:
    (pair,) = entry["QA"]
    read, right = read_question(str(pair["q"])), str(pair["a"])
    chosen = _ANSWER.match(right)
    if chosen is None:
        raise ValueError(f"the answer {right!r} names no option")
    letter = chosen.group(1)
    if right[chosen.end() :].strip() != read.options[LETTERS.index(letter)]:
        raise ValueError(f"the answer {right!r} is not the text of its option")
    token = str(entry["sample_token"])
    return VqaItem(
        id=f"{place:05d}.{token}",
        token=token,
        previous=str(entry.get("prev") or ""),
        subtask=str(entry["task"]),
        split=str(entry.get("split", "")),
        preamble=read.preamble,
        speeds_mps=read.speeds_mps,
        steering_deg=read.steering_deg,
        question=read.question,
        options=read.options,
        answer=LETTERS.index(letter),
    )


def _numbers(text: str) -> tuple[float, ...]:
    return tuple(float(part) for part in text.split(",") if part.strip())


def _chained(items: Sequence[VqaItem]) -> tuple[VqaItem, ...]:
    """Items with the name of their chain: the first token that `prev` leads back to within the file, or beyond it."""
    before = {item.token: item.previous for item in items}
    names: dict[str, str] = {}
    for item in items:
        token, way = item.token, [item.token]
        while token not in names and (previous := before.get(token, "")) and previous not in way:
            token = previous
            way.append(token)
        name = names.get(token, token)
        names.update(dict.fromkeys(way, name))
    return tuple(replace(item, chain=names[item.token]) for item in items)
