"""nuScenes as its files are: tables of JSON rows linked by tokens. No devkit: planning needs six of the tables.

    ROOT/v1.0-mini/scene.json ...     tables: scene, sample, sample_data, ego_pose, calibrated_sensor, sensor
    ROOT/samples/CAM_FRONT/*.jpg      pictures, as `sample_data.filename` names them

Samples are key frames at 2 Hz, as their time stamps say; sets with more are thinned to that by them, and what lies on
the two sides of a gap is not taken for one drive. Poses are of the rear axle's middle in the map's frame (x east,
y north, m; quaternion w, x, y, z); time stamps are microseconds. Everything that leaves this module is in the ego's own
frame at the present instant: x ahead, y left, m. nuScenes' data are under CC BY-NC-SA 4.0; none of them are in this
package.

A set of our own has a further table beside them, `openloop.json`: which samples are asked about, what the navigation
says there, and what happens (`OpenLoopMark`).
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeGuard, cast

import numpy as np
from pydantic import TypeAdapter

from chauffeur.concept import DataError
from chauffeur.foreign.waypoints import FUTURE, STEP_S
from chauffeur.planners.prompts.waypoints import HISTORY, command_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    FloatArray = NDArray[np.float64]

TABLES: Final = ("scene", "sample", "sample_data", "ego_pose", "calibrated_sensor", "sensor")
MOST_OFF_S: Final = 0.2
"""nuScenes' key frames are the LIDAR sweeps (20 Hz) closest to every half second, and sweeps are lost at times."""
USUALLY_OFF_S: Final = 0.05
"""Deviation of a scene's median step from half a second up to which it is at 2 Hz."""
THINNED_OFF_S: Final = 0.06
"""Half a period of 10 Hz, and a little: sets of more than 2 Hz have a sample so close to every half second."""
CAMERA: Final = "CAM_FRONT"
_ROTATION_OFF: Final = 0.01
"""A quaternion of another length than one is none."""
_MOST_STAMP: Final = 1e17
"""Microseconds until the year 5138; float NaN and infinity are not below it."""
_MOST_BYTES: Final = 4_000_000_000
"""The largest table of the whole of nuScenes (`sample_annotation`, which is not read) has 1.5 GB."""
MARKS: Final = "openloop.json"

Row = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class OpenLoopMark:
    """Mark of a sample in a set of our own.

    Attributes:
        sample: Its token.
        command: What the navigation says.
        kind: What happens next, e.g. `brakes`.
        place: Where it is, e.g. `town`.
    """

    sample: str
    command: str
    kind: str
    place: str


@dataclass(frozen=True)
class PlanningSample:
    """One instant, and what the car had done and then did. Ego frame of that instant: x ahead, y left, m.

    Attributes:
        id: Token of the sample.
        scene: Name of its scene.
        picture: File of the front camera's picture.
        history: Poses (x, y, heading rad), oldest first, the present one last; (HISTORY + 1, 3).
        future: Where the car was then, every 0.5 s; (steps, 2), FUTURE unless asked otherwise; NaN where the scene had
            ended.
        command: High-level command; empty for none.
        kind, place: Of our own sets; empty otherwise.
    """

    id: str
    scene: str
    picture: Path
    history: FloatArray
    future: FloatArray
    command: str = ""
    kind: str = ""
    place: str = ""

    @property
    def whole(self) -> bool:
        """True if its future is known to the end."""
        return bool(np.isfinite(self.future).all())

    @property
    def speeds_mps(self) -> FloatArray:
        """Over each half second of the history, (HISTORY,)."""
        return np.hypot(*np.diff(self.history[:, :2], axis=0).T) / STEP_S


def yaw_of(rotation: Sequence[float]) -> float:
    """Heading of a quaternion (w, x, y, z), rad."""
    w, x, y, z = rotation
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def in_frame(poses: FloatArray, origin: FloatArray) -> FloatArray:
    """Poses (n, 3) as seen from another (3,): x ahead, y left, heading relative."""
    dx, dy = poses[:, 0] - origin[0], poses[:, 1] - origin[1]
    c, s = math.cos(origin[2]), math.sin(origin[2])
    turned = (poses[:, 2] - origin[2] + math.pi) % (2.0 * math.pi) - math.pi
    return np.stack((c * dx + s * dy, c * dy - s * dx, turned), axis=1)


def future_command(future: FloatArray) -> str:
    """The command that ST-P3 and UniAD read off the true future's first 3 s: it is no input that a car would have."""
    last = future[FUTURE - 1, 1]
    if not math.isfinite(last):
        return ""
    return command_of(float(last))


class NuScenesTables:
    """The tables of one version."""

    def __init__(self, root: Path, version: str) -> None:
        """Read them.

        Args:
            root: Folder that holds `samples` and the version's folder.
            version: E.g. `v1.0-mini`, `v1.0-trainval`.

        Raises:
            DataError: A table is missing or malformed.
        """
        self.root, self.folder = root, root / version
        if not self.folder.is_dir():
            known = ", ".join(sorted(one.parent.name for one in root.glob("*/sample.json"))) or "none"
            raise DataError(f"{root} has no version {version!r}.", hint=f"There: {known}. Name its tables.")
        digest = hashlib.sha256()
        self._tables = {name: self._read(name, digest) for name in TABLES}
        marks = self.folder / MARKS
        self.marks: tuple[OpenLoopMark, ...] | None = None
        if marks.is_file():
            content = marks.read_bytes()
            digest.update(content)
            try:
                self.marks = TypeAdapter(tuple[OpenLoopMark, ...]).validate_json(content)
            except ValueError as error:
                raise DataError(f"{marks} is malformed: {error}.") from error
        self.sha256 = digest.hexdigest()

    def _read(self, name: str, digest: Any) -> dict[str, Row]:
        path = self.folder / f"{name}.json"
        try:
            if path.stat().st_size > _MOST_BYTES:
                raise DataError(f"{path} is no table of nuScenes: it has more than {_MOST_BYTES / 1e9:g} GB.")
            content = path.read_bytes()
            rows: Any = json.loads(content)
        except OSError as error:
            raise DataError(
                f"The table {path} cannot be read: {error.strerror}.", hint="Unpack nuScenes' metadata there."
            ) from error
        except (ValueError, RecursionError) as error:
            raise DataError(f"{path} is no table of nuScenes: {type(error).__name__} {error}.") from error
        if not isinstance(rows, list):
            raise DataError(f"{path} is no table of nuScenes: it is no list of rows.")
        table: dict[str, Row] = {}
        for number, row in enumerate(cast("list[Any]", rows)):
            token = cast("Row", row).get("token") if isinstance(row, dict) else None
            if not isinstance(token, str) or not token:
                raise DataError(f"{path} is no table of nuScenes: row {number} has no token.")
            table[token] = row
        digest.update(name.encode() + content)
        return table

    def _text(self, table: str, token: str, field: str, *, empty: bool = False) -> str:
        """A field that is a text. Raises DataError."""
        value = self._row(table, token).get(field)
        if not isinstance(value, str) or not (value or empty):
            raise self._wrong(table, token, field, value, "a text")
        return value

    def _numbers(self, table: str, token: str, field: str, count: int) -> tuple[float, ...]:
        """A field that is so many numbers. Raises DataError."""
        value = self._row(table, token).get(field)
        numbers = cast("list[Any]", value) if isinstance(value, list) else []
        if len(numbers) != count or not all(_is_number(one) for one in numbers):
            raise self._wrong(table, token, field, value, f"{count} numbers")
        return tuple(float(one) for one in numbers)

    def _row(self, table: str, token: str) -> Row:
        """A row by its token. Raises DataError."""
        row = self._tables[table].get(token)
        if row is None:
            raise DataError(f"{self.folder / table}.json has no row {token!r}, which another table names.")
        return row

    def _wrong(self, table: str, token: str, field: str, value: object, right: str) -> DataError:
        said = "is missing" if value is None else f"is {repr(value)[:80]}"
        return DataError(
            f"{self.folder / table}.json, row {token!r}: {field!r} {said}; {right} is right.",
            hint="Is the set converted by nuScenes' scheme?",
        )

    @cached_property
    def _frames(self) -> dict[str, str]:
        """Tokens of the key frames of the front camera in `sample_data`, by sample."""
        own = {
            token
            for token in self._tables["calibrated_sensor"]
            if self._text("sensor", self._text("calibrated_sensor", token, "sensor_token"), "channel") == CAMERA
        }
        return {
            self._text("sample_data", token, "sample_token"): token
            for token, row in self._tables["sample_data"].items()
            if row.get("is_key_frame") is not False
            and self._text("sample_data", token, "calibrated_sensor_token") in own
            and self._is_key(token, row)
        }

    def _is_key(self, token: str, row: Row) -> bool:
        if not isinstance(row.get("is_key_frame"), bool):
            raise self._wrong("sample_data", token, "is_key_frame", row.get("is_key_frame"), "true or false")
        return bool(row["is_key_frame"])

    @property
    def scenes(self) -> frozenset[str]:
        """Names of all scenes. Raises DataError: one has none."""
        return frozenset(self._text("scene", token, "name") for token in self._tables["scene"])

    def _chain(self, scene: str) -> list[str]:
        """Samples of a scene in order."""
        found, seen = list[str](), set[str]()
        at = self._text("scene", scene, "first_sample_token")
        while at:
            if at in seen:
                raise DataError(f"{self.folder}/sample.json leads in a circle: {at!r} comes twice in scene {scene!r}.")
            found.append(at)
            seen.add(at)
            at = self._text("sample", at, "next", empty=True)
        return found

    def _drives(self, scene: str) -> list[list[str]]:
        """Stretches of a scene's samples at 2 Hz: with more than that the ones closest to every half second."""
        chain = self._chain(scene)
        at_s = [self._time_s(token) for token in chain]
        steps = np.diff(at_s)
        if (steps <= 0.0).any():
            late = int(np.argmax(steps <= 0.0)) + 1
            raise self._wrong("sample", chain[late], "timestamp", at_s[late] * 1e6, "a later time than before it")
        usual = float(np.median(steps)) if len(steps) else STEP_S
        cut = _thinned(at_s) if usual < STEP_S - USUALLY_OFF_S else _stretches(at_s)
        if len(chain) > HISTORY and (usual > STEP_S + USUALLY_OFF_S or all(len(one) == 1 for one in cut)):
            raise DataError(
                f"The samples of scene {self._text('scene', scene, 'name')!r} in {self.folder} lie {usual:.3g} s apart "
                f"by their time stamps (microseconds); one every {STEP_S:g} s is needed.",
                hint="Take key frames every half second, or all of them.",
            )
        return [[chain[i] for i in one] for one in cut]

    def _time_s(self, sample: str) -> float:
        value = self._row("sample", sample).get("timestamp")
        if not _is_number(value):
            raise self._wrong("sample", sample, "timestamp", value, "a time in microseconds")
        return float(value) * 1e-6

    def samples(self, scenes: frozenset[str] | None = None, steps: int = FUTURE) -> list[PlanningSample]:
        """Every sample with 2 s before it and at least one after; of a marked set the marked ones.

        Args:
            scenes: Names of those that count; None for all.
            steps: Length of the futures, at least FUTURE.

        Raises:
            DataError: A link leads nowhere.
        """
        marks = None if self.marks is None else {one.sample: one for one in self.marks}
        found: list[PlanningSample] = []
        for scene in self._tables["scene"]:
            name = self._text("scene", scene, "name")
            if scenes is None or name in scenes:
                for drive in self._drives(scene):
                    found += self._samples_of(name, drive, marks, steps)
        return found

    def _samples_of(
        self, scene: str, drive: Sequence[str], marks: Mapping[str, OpenLoopMark] | None, steps: int
    ) -> Iterator[PlanningSample]:
        poses, files = self._driven(drive)
        for at in range(HISTORY, len(drive) - 1):
            mark = None if marks is None else marks.get(drive[at])
            if marks is not None and mark is None:
                continue
            history = in_frame(poses[at - HISTORY : at + 1], poses[at])
            future = np.full((steps, 2), np.nan)
            after = in_frame(poses[at + 1 : at + 1 + steps], poses[at])[:, :2]
            future[: len(after)] = after
            said = future_command(future) if mark is None else mark.command
            kind, place = ("", "") if mark is None else (mark.kind, mark.place)
            yield PlanningSample(drive[at], scene, self.root / files[at], history, future, said, kind, place)

    def _driven(self, chain: Sequence[str]) -> tuple[FloatArray, list[str]]:
        """Poses (n, 3) and picture files of samples."""
        poses = np.zeros((len(chain), 3))
        files: list[str] = []
        for i, token in enumerate(chain):
            frame = self._frames.get(token)
            if frame is None:
                raise DataError(f"Sample {token!r} of {self.folder} has no {CAMERA} key frame in sample_data.json.")
            pose = self._text("sample_data", frame, "ego_pose_token")
            rotation = self._numbers("ego_pose", pose, "rotation", 4)
            if abs(math.hypot(*rotation) - 1.0) > _ROTATION_OFF:
                raise self._wrong("ego_pose", pose, "rotation", list(rotation), "a quaternion of length 1")
            poses[i] = (*self._numbers("ego_pose", pose, "translation", 3)[:2], yaw_of(rotation))
            file = self._text("sample_data", frame, "filename")
            if Path(file).is_absolute() or ".." in Path(file).parts:
                raise self._wrong("sample_data", frame, "filename", file, "a file below the set's folder")
            files.append(file)
        return poses, files


def _stretches(at_s: Sequence[float]) -> list[list[int]]:
    """Places of samples, cut where one is missing or too many."""
    found = [[0]]
    for i in range(1, len(at_s)):
        if abs(at_s[i] - at_s[i - 1] - STEP_S) > MOST_OFF_S:
            found.append([])
        found[-1].append(i)
    return found


def _thinned(at_s: Sequence[float]) -> list[list[int]]:
    """Places of the samples closest to every half second from the start of a stretch; a new one where none is."""
    times, found = np.array(at_s), [[0]]
    while found[-1][-1] + 1 < len(times):
        first, last = found[-1][0], found[-1][-1]
        target = times[first] + STEP_S * len(found[-1])
        nearest = last + 1 + int(np.argmin(np.abs(times[last + 1 :] - target)))
        if abs(times[nearest] - target) <= THINNED_OFF_S:
            found[-1].append(nearest)
        elif times[-1] < target:
            break
        else:
            found.append([last + 1])
    return found


def _is_number(value: object) -> TypeGuard[float]:
    """True if a JSON value is a number that makes sense as a place or a time."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < _MOST_STAMP
