"""doScenes' annotations: what people would tell a car to do in scenes of nuScenes (arXiv 2412.05893).

    FOLDER/doScenesAnnotations - Annotator 1.csv ...     one file an annotator; further columns are ignored
    Scene Number,Instruction Type,Instruction
    12,ds,"behind the kiosk keep left, then wait for the tram"

Scene number 12 is nuScenes' `scene-0012`. The type says what the words refer to: `s` something static, `d` something
dynamic, both (`ds`, `sd`, `s,d`), or nothing. A scene without an instruction was looked at and needs none. The texts
are published without a licence; none of them are in this package.
"""

from __future__ import annotations

import csv
import hashlib
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal, get_args

from chauffeur.concept import DataError

InstructionKind = Literal["static", "dynamic", "static and dynamic", "no reference"]
INSTRUCTION_KINDS: Final[tuple[InstructionKind, ...]] = get_args(InstructionKind)
_KINDS: Final[dict[frozenset[str], InstructionKind]] = {
    frozenset("s"): "static",
    frozenset("d"): "dynamic",
    frozenset("sd"): "static and dynamic",
    frozenset(): "no reference",
}
_COLUMNS: Final = ("scene number", "instruction type", "instruction")
_SCENE: Final = re.compile(r"(\d{1,4})(?:\.0)?")
"""A scene number; tables that went through a spreadsheet or pandas write `12.0`."""
_BETWEEN: Final = re.compile(r"[\s,;/&+]+")
_MOST_FILES: Final = 200
_MOST_BYTES: Final = 10_000_000
"""A file of all annotators together has 120 kB."""
_MOST_CHARS: Final = 2_000
"""The longest published instruction has a few hundred."""
_MOST_LINES: Final = 10
"""Lines that a quoted text may span before its quote counts as never closed."""


@dataclass(frozen=True, slots=True)
class SceneInstruction:
    """Instruction of an annotator for a scene.

    Attributes:
        scene: nuScenes' name of it.
        kind: What the words refer to.
        text: The words, white space collapsed.
        place: `FILE:LINE`.
    """

    scene: str
    kind: InstructionKind
    text: str
    place: str


@dataclass(frozen=True, slots=True)
class Annotations:
    """All files.

    Attributes:
        instructions: In the order of files by name, and lines.
        blank: Number of rows without an instruction.
        malformed: `FILE:LINE: what is wrong` of each row that was left out.
        sha256: Of the files.
    """

    instructions: tuple[SceneInstruction, ...]
    blank: int
    malformed: tuple[str, ...]
    sha256: str


def read_annotations(path: Path) -> Annotations:
    """Read a file, or all `*.csv` of a folder; a malformed row costs itself alone.

    Raises:
        DataError: There is no file, one cannot be read, or one has not doScenes' columns.
    """
    files = sorted(path.glob("*.csv")) if path.is_dir() else [path]
    if not 0 < len(files) <= _MOST_FILES:
        raise DataError(
            f"{path} holds {len(files)} CSV files of annotations; 1 to {_MOST_FILES} are right.",
            hint="Name doScenes' folder `Annotations`.",
        )
    digest, blank = hashlib.sha256(), 0
    instructions, malformed = list[SceneInstruction](), list[str]()
    for file in files:
        content = _content(file)
        digest.update(content)
        records = _records(content)
        columns = _columns(file, next(records, None))
        for line, cells in records:
            place = f"{file.name}:{line}"
            if isinstance(cells, str):
                malformed.append(f"{place}: {cells}")
                continue
            number, kind, text = (" ".join(cells[at].split()) if at < len(cells) else "" for at in columns)
            if not text:
                blank += bool(number)
                continue
            found = _instruction(number, kind, text, place)
            if isinstance(found, str):
                malformed.append(f"{place}: {found}")
            else:
                instructions.append(found)
    return Annotations(tuple(instructions), blank, tuple(malformed), digest.hexdigest())


def _content(file: Path) -> bytes:
    try:
        if file.stat().st_size > _MOST_BYTES:
            raise DataError(f"{file} is no file of annotations: it has more than {_MOST_BYTES / 1e6:g} MB.")
        return file.read_bytes()
    except OSError as error:
        raise DataError(f"The annotations {file} cannot be read: {error.strerror}.") from error


def _columns(file: Path, header: tuple[int, Sequence[str] | str] | None) -> tuple[int, ...]:
    """Places of the three columns."""
    cells = [] if header is None or isinstance(header[1], str) else [one.strip().lower() for one in header[1]]
    if missing := [name for name in _COLUMNS if name not in cells]:
        raise DataError(
            f"{file} is no file of doScenes' annotations: its first line has no column {missing[0]!r}.",
            hint="Its first line is `Scene Number,Instruction Type,Instruction`.",
        )
    return tuple(cells.index(name) for name in _COLUMNS)


def _records(content: bytes) -> Iterator[tuple[int, Sequence[str] | str]]:
    """(first line, cells, or what is wrong with it) of each record. Lines are decoded and parsed apart, so that a bad
    byte, or a quote that is never closed, costs its own line."""
    lines = content.removeprefix(b"\xef\xbb\xbf").splitlines()
    at = 0
    while at < len(lines):
        for many in range(1, _MOST_LINES + 1):
            found = _record(lines[at : at + many])
            if not isinstance(found, str):
                break
        else:
            found, many = _record(lines[at : at + 1]), 1
        yield at + 1, found
        at += many


def _record(lines: Sequence[bytes]) -> Sequence[str] | str:
    """The cells of one record that spans all these lines, or what is wrong."""
    try:
        return next(csv.reader([line.decode() + "\n" for line in lines], strict=True), [])
    except UnicodeDecodeError:
        return "it is not UTF-8"
    except csv.Error as error:
        return f"it is no CSV ({error})"


def _instruction(number: str, kind: str, text: str, place: str) -> SceneInstruction | str:
    """A row that has an instruction, or what is wrong with it."""
    scene = _SCENE.fullmatch(number)
    if scene is None:
        return f"{number[:40]!r} is no scene number"
    refers = _KINDS.get(frozenset(_BETWEEN.sub("", kind.lower())))
    if refers is None:
        return f"{kind[:40]!r} is no instruction type (s, d, both or nothing)"
    if len(text) > _MOST_CHARS:
        return f"the instruction has {len(text)} characters, more than {_MOST_CHARS}"
    if not text.isprintable():
        return "the instruction has characters that cannot be printed"
    return SceneInstruction(f"scene-{int(scene[1]):04}", refers, text, place)
