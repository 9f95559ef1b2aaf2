"""A split of frames as arrays: pictures, what the car knows of its own motion, what the navigation says, the truth."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from chauffeur.bench.openloop.extrapolation import constant_turn_and_acceleration, constant_velocity
from chauffeur.bench.openloop.frames import PERCEPTION
from chauffeur.bench.openloop.nuscenes import NuScenesTables, PlanningSample
from chauffeur.concept import DataError

if TYPE_CHECKING:
    from numpy.typing import NDArray

Array = np.ndarray[Any, Any]

EGO_WIDTH: Final = 33
"""Numbers of `ego_features`."""
SCALE_M: Final = 60.0


@dataclass(frozen=True)
class FrameSet:
    """A split.

    Attributes:
        samples: Where each frame comes from.
        pictures: (n, H, W, 3) uint8.
        histories: (n, 5, 3).
        futures: (n, 6, 2).
        known: What the simulator knows of each picture (`driving.Instant`: lead gap, lead speed, halt, junction), each
            about 0 to 1; (n, 4), NaN where nothing is known.
    """

    samples: tuple[PlanningSample, ...]
    pictures: NDArray[np.uint8]
    histories: Array
    futures: Array
    known: Array

    @property
    def commands(self) -> list[str]:
        """Commands of the navigation, one a sample."""
        return [one.command for one in self.samples]

    def part(self, kept: NDArray[np.bool_]) -> FrameSet:
        """Those frames alone, by a mask (n,)."""
        samples = tuple(one for one, own in zip(self.samples, kept, strict=True) if own)
        return FrameSet(samples, self.pictures[kept], self.histories[kept], self.futures[kept], self.known[kept])

    @property
    def ego(self) -> Array:
        """`ego_features` of each, (n, EGO_WIDTH), float32."""
        return np.stack([ego_features(one) for one in self.histories])


def ego_features(history: Array) -> Array:
    """Features of a car's own motion, each number about 1: (EGO_WIDTH,), float32.

    Args:
        history: (5, 3): poses, speeds over each half second, their changes, and how far a constant turn rate and
            acceleration would lead from constant velocity.
    """
    speeds = np.hypot(*np.diff(history[:, :2], axis=0).T) / 0.5
    changes = np.diff(speeds) / 0.5
    turning = constant_turn_and_acceleration(history) - constant_velocity(history)
    parts = (
        (history[:-1] / np.array([20.0, 2.0, 0.3])).ravel(),
        speeds / 10.0,
        changes / 3.0,
        (turning / np.array([10.0, 5.0])).ravel(),
        np.array([speeds[-1] < 0.3, speeds[-1] / 30.0]),
    )
    return np.concatenate(parts).astype(np.float32)


def picture(path: Path, size: tuple[int, int]) -> NDArray[np.uint8]:
    """A picture file as (H, W, 3). Raises DataError: it is missing or damaged."""
    from PIL import Image

    try:
        with Image.open(path) as image:
            return fitted(image, size)
    except OSError as error:
        raise DataError(f"The picture {path} cannot be read: {error}.") from error


def fitted(image: Any, size: tuple[int, int]) -> NDArray[np.uint8]:
    """A PIL picture cut from above and below to the aspect ratio of (height, width), and scaled to it."""
    height, width = size
    image = image.convert("RGB")
    if image.size == (width, height):
        return np.array(image)
    tall = round(image.width * height / width)
    if tall < image.height:
        top = (image.height - tall) // 2
        image = image.crop((0, top, image.width, top + tall))
    return np.array(image.resize((width, height)))


def load_frames(root: Path, split: str, size: tuple[int, int], limit: int = 0) -> FrameSet:
    """A split of a set, or a version of nuScenes; samples whose future is not known are left out.

    Args:
        root: Folder of the set.
        split: `train`, `val` or `test`.
        size: (height, width) of the pictures.
        limit: Only the first so many; 0 for all.

    Raises:
        DataError: Tables or pictures cannot be read, or there are no samples.
    """
    tables = NuScenesTables(root, f"v1.0-{split}")
    samples = [one for one in tables.samples() if one.whole][: limit or None]
    if not samples:
        raise DataError(f"{tables.folder} has no samples with 2 s before and 3 s after them.")
    return FrameSet(
        tuple(samples),
        np.stack([picture(one.picture, size) for one in samples]),
        np.stack([one.history for one in samples]),
        np.stack([one.future for one in samples]),
        _known(tables.folder / PERCEPTION, samples),
    )


def joined(sets: Sequence[FrameSet]) -> FrameSet:
    """Several sets as one; scenes of the same name in two of them stay two."""
    if len(sets) == 1:
        return sets[0]
    samples = [replace(one, scene=f"{at}/{one.scene}") for at, held in enumerate(sets) for one in held.samples]
    pictures = np.concatenate([one.pictures for one in sets])
    histories, futures, known = (
        np.concatenate([getattr(one, name) for one in sets]) for name in ("histories", "futures", "known")
    )
    return FrameSet(tuple(samples), pictures, histories, futures, known)


def _known(path: Path, samples: Sequence[PlanningSample]) -> Array:
    held: dict[str, list[float]] = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
    none = [float("nan")] * 4
    values = np.array([held.get(one.id, none) for one in samples])
    return (values / np.array([SCALE_M, 15.0, SCALE_M, SCALE_M])).astype(np.float32)
