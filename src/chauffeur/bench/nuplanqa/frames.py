"""Pictures of a sample: which files they are, and their bytes as a model gets them.

nuPlan's layout: `part_<n>/<hash>.jpg` below a root, named by `cams.<camera>.data_path` of the metadata. Samples come at
2 Hz; `prev` leads to the one before.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from chauffeur.bench.pictures import MISSING
from chauffeur.concept import DataError

CAMERAS: Final = ("CAM_F0", "CAM_L0", "CAM_R0", "CAM_L2", "CAM_R2", "CAM_B0")
"""The six of nuPlan's eight cameras that NuPlanQA's metadata name."""
VIEW_NAMES: Final[Mapping[str, str]] = {
    "CAM_F0": "front",
    "CAM_L0": "front left",
    "CAM_R0": "front right",
    "CAM_L1": "left",
    "CAM_R1": "right",
    "CAM_L2": "rear left",
    "CAM_R2": "rear right",
    "CAM_B0": "rear",
}
STEP_S: Final = 0.5
"""Time between samples."""
FRAMES: Final = 4
"""Samples of a multi-frame question: the last 1.5 s."""

UNTOLD: Final = "No metadata"
"""Start of the error of an item without metadata; counted apart, as those of `bench.pictures` are."""


@dataclass(frozen=True, slots=True)
class FramePath:
    """A picture of a sample.

    Attributes:
        camera: nuPlan's name of the camera.
        ago_s: How long before the instant of the question it was taken.
        path: Its file.
    """

    camera: str
    ago_s: float
    path: Path

    @property
    def caption(self) -> str:
        """Caption for the model: `CAM_F0 (front), 0.5 s ago`."""
        when = "now" if self.ago_s == 0.0 else f"{self.ago_s:g} s ago"
        return f"{self.camera} ({VIEW_NAMES.get(self.camera, self.camera)}), {when}"


@dataclass(frozen=True)
class FrameSource:
    """Locations of a data set's pictures.

    Attributes:
        root: Folder below which `data_path` is.
        metadata: By token.
        cameras: Which cameras a question comes with.
        frames: How many samples back in time, the present one included.
    """

    root: Path
    metadata: Mapping[str, Mapping[str, Any]]
    cameras: Sequence[str] = CAMERAS
    frames: int = FRAMES

    def scene_type(self, token: str) -> str:
        """Kind of scene in the metadata; empty where they have none."""
        return str(self.metadata.get(token, {}).get("scenario") or "")

    def paths(self, token: str) -> tuple[FramePath, ...]:
        """The pictures of a sample, oldest first. At the beginning of a scene there are fewer frames.

        Raises:
            DataError: The metadata do not know the sample, or a camera of it.
        """
        if token not in self.metadata:
            raise DataError(f"{UNTOLD}: the sample {token} is not in the metadata.")
        chain: list[str] = []
        at = token
        while at in self.metadata and len(chain) < self.frames and at not in chain:
            chain.append(at)
            at = str(self.metadata[at].get("prev") or "")
        found: list[FramePath] = []
        for back, one in reversed(list(enumerate(chain))):
            cams: Any = self.metadata[one].get("cams")
            for camera in self.cameras:
                named = cams.get(camera) if isinstance(cams, Mapping) else None
                file = named.get("data_path") if isinstance(named, Mapping) else None
                if not isinstance(file, str) or not file:
                    raise DataError(f"{MISSING}: the metadata of {one} have no {camera}.")
                if Path(file).is_absolute() or ".." in Path(file).parts:
                    raise DataError(f"{MISSING}: the {camera} of {one} lies outside of the set: {file!r}.")
                path = self.root / file
                found.append(FramePath(camera, self._ago_s(token, one, back), path))
        return tuple(found)

    def _ago_s(self, token: str, before: str, back: int) -> float:
        """Time between two samples, by their time stamps (microseconds), else by their places."""
        then, now = (self.metadata[one].get("timestamp") for one in (before, token))
        if then is None or now is None:
            return back * STEP_S
        try:
            ago_s = (float(now) - float(then)) * 1e-6
        except (TypeError, ValueError, OverflowError):
            ago_s = math.nan
        if not (ago_s > 0.0 if back else ago_s == 0.0):
            raise DataError(f"{MISSING}: {before} is not before {token} by their time stamps, {then!r} and {now!r}.")
        return round(ago_s, 2)

    def missing(self, tokens: Sequence[str]) -> tuple[Path, ...]:
        """Files that the samples need and that are not there, as far as the metadata name them."""
        wanted: dict[Path, None] = {}
        for token in tokens:
            try:
                wanted |= dict.fromkeys(frame.path for frame in self.paths(token))
            except DataError:  # told of the item itself, when it is asked
                continue
        return tuple(path for path in wanted if not path.is_file())
