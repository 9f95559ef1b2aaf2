"""nuScenes as its files are: tables of JSON rows linked by tokens. No devkit: planning needs six of the tables.

    ROOT/v1.0-mini/scene.json ...     tables: scene, sample, sample_data, ego_pose, calibrated_sensor, sensor
    ROOT/samples/CAM_FRONT/*.jpg      pictures, as `sample_data.filename` names them

Samples are key frames at 2 Hz. Poses are of the rear axle's middle in the map's frame (x east, y north, m; quaternion
w, x, y, z); time stamps are microseconds. Everything that leaves this module is in the ego's own frame at the present
instant: x ahead, y left, m. nuScenes' data are under CC BY-NC-SA 4.0; none of them are in this package.

A set of our own has a further table beside them, `openloop.json`: which samples are asked about, what the navigation
says there, and what happens (`OpenLoopMark`).
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, cast

import numpy as np

from chauffeur.concept import DataError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    FloatArray = NDArray[np.float64]

TABLES: Final = ("scene", "sample", "sample_data", "ego_pose", "calibrated_sensor", "sensor")
STEP_S: Final = 0.5
HISTORY: Final = 4
"""Samples before the present one: 2 s."""
FUTURE: Final = 6
"""Waypoints: 3 s."""
CAMERA: Final = "CAM_FRONT"
MARKS: Final = "openloop.json"
ASIDE_M: Final = 2.0
"""ST-P3's and UniAD's high-level command: left or right where the car is so far aside after 3 s."""

Row = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class OpenLoopMark:
    """What a set of our own says of a sample.

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
        future: Where the car was then, every 0.5 s; (FUTURE, 2); NaN where the scene had ended.
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
        """Whether its future is known to the end."""
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
    """The command that ST-P3 and UniAD read off the true future (6, 2): it is no input that a car would have."""
    last = future[-1, 1]
    if not math.isfinite(last):
        return ""
    return "turn left" if last >= ASIDE_M else "turn right" if last <= -ASIDE_M else "go straight"


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
            raise DataError(f"{root} has no version {version!r}.", hint=f"There: {known}. Set version=NAME.")
        digest = hashlib.sha256()
        self._tables = {name: self._read(name, digest) for name in TABLES}
        marks = self.folder / MARKS
        self.marks: tuple[OpenLoopMark, ...] | None = None
        if marks.is_file():
            content = marks.read_bytes()
            digest.update(content)
            try:
                self.marks = tuple(OpenLoopMark(**one) for one in json.loads(content))
            except (ValueError, TypeError) as error:
                raise DataError(f"{marks} is malformed: {error}.") from error
        self.sha256 = digest.hexdigest()

    def _read(self, name: str, digest: Any) -> dict[str, Row]:
        path = self.folder / f"{name}.json"
        try:
            content = path.read_bytes()
            rows = cast("list[Row]", json.loads(content))
            table = {str(row["token"]): row for row in rows}
        except OSError as error:
            raise DataError(
                f"The table {path} cannot be read: {error.strerror}.", hint="Unpack nuScenes' metadata there."
            ) from error
        except (ValueError, KeyError, TypeError) as error:
            raise DataError(f"{path} is no table of nuScenes: {type(error).__name__} {error}.") from error
        digest.update(name.encode() + content)
        return table

    @cached_property
    def _frames(self) -> dict[str, Row]:
        """Key frames of the front camera, by sample."""
        channels = {token: str(row["channel"]) for token, row in self._tables["sensor"].items()}
        own = {
            token for token, row in self._tables["calibrated_sensor"].items() if channels[row["sensor_token"]] == CAMERA
        }
        return {
            str(row["sample_token"]): row
            for row in self._tables["sample_data"].values()
            if row["is_key_frame"] and row["calibrated_sensor_token"] in own
        }

    def _chain(self, scene: Row) -> list[str]:
        """Samples of a scene in order."""
        samples, found = self._tables["sample"], list[str]()
        at = str(scene["first_sample_token"])
        while at:
            if at not in samples or len(found) > len(samples):
                raise DataError(f"Scene {scene['name']} of {self.folder} links to no sample {at!r}.")
            found.append(at)
            at = str(samples[at]["next"])
        return found

    def samples(self, scenes: frozenset[str] | None = None) -> list[PlanningSample]:
        """Every sample with 2 s before it and at least one after; of a marked set the marked ones.

        Args:
            scenes: Names of those that count; None for all.

        Raises:
            DataError: A link leads nowhere.
        """
        marks = None if self.marks is None else {one.sample: one for one in self.marks}
        found: list[PlanningSample] = []
        for scene in self._tables["scene"].values():
            name = str(scene["name"])
            if scenes is not None and name not in scenes:
                continue
            chain = self._chain(scene)
            poses, files = self._driven(chain)
            for at in range(HISTORY, len(chain) - 1):
                mark = None if marks is None else marks.get(chain[at])
                if marks is not None and mark is None:
                    continue
                history = in_frame(poses[at - HISTORY : at + 1], poses[at])
                future = np.full((FUTURE, 2), np.nan)
                after = in_frame(poses[at + 1 : at + 1 + FUTURE], poses[at])[:, :2]
                future[: len(after)] = after
                said = future_command(future) if mark is None else mark.command
                kind, place = ("", "") if mark is None else (mark.kind, mark.place)
                found.append(PlanningSample(chain[at], name, self.root / files[at], history, future, said, kind, place))
        return found

    def _driven(self, chain: Sequence[str]) -> tuple[FloatArray, list[str]]:
        """Poses (n, 3) and picture files of samples."""
        poses = np.zeros((len(chain), 3))
        files: list[str] = []
        for i, token in enumerate(chain):
            frame = self._frames.get(token)
            pose = None if frame is None else self._tables["ego_pose"].get(str(frame["ego_pose_token"]))
            if frame is None or pose is None:
                raise DataError(f"Sample {token} of {self.folder} has no {CAMERA} frame with a pose.")
            poses[i] = (*pose["translation"][:2], yaw_of(pose["rotation"]))
            files.append(str(frame["filename"]))
        return poses, files
