"""Output of a renderer: pictures, and the ground truth of each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from chauffeur.concept import CameraImage

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from chauffeur.camera.rig import Camera
    from chauffeur.camera.scene import Instance
    from chauffeur.camera.weather import Conditions

    FloatArray = NDArray[np.float64]

PixelBox = tuple[float, float, float, float]
"""(left, top, right, bottom), px; right and bottom are the first pixels outside."""


@dataclass(frozen=True, slots=True)
class Sighting:
    """An instance in one picture.

    Attributes:
        instance: What it is.
        box: Tight box round its visible pixels.
        full_box: Of its 3-D box, cut to the image: hidden parts included.
        pixels: How many pixels show it.
        visibility: Share of what it covers in this image that nothing hides, 0 to 1.
        truncation: Share of its 3-D box's outline that lies outside the image, 0 to 1.
        depth_m: Along the optical axis, to the middle of its 3-D box.
    """

    instance: Instance
    box: PixelBox
    full_box: PixelBox
    pixels: int
    visibility: float
    truncation: float
    depth_m: float


@dataclass(frozen=True)
class ImageLane:
    """A lane as it lies in one picture, whatever may stand in front of it.

    Attributes:
        lane: Its name in the road graph.
        ego: Whether the ego is on it.
        centre: Its middle (n, 2), px, in driving direction, of the part before the camera.
        left: Its left edge (n, 2), px.
        right: Its right edge (n, 2), px.
        depth_m: Along the optical axis, of each of the three rows of points (3, n): centre, left, right.
    """

    lane: str
    ego: bool
    centre: FloatArray
    left: FloatArray
    right: FloatArray
    depth_m: FloatArray


@dataclass(frozen=True)
class ImageTruth:
    """Ground truth of one picture.

    Attributes:
        camera: Name of the camera.
        instances: Number of the instance that each pixel shows, 0 for none, (H, W) uint16.
        classes: `SemanticClass` of each pixel, (H, W) uint8.
        depth_m: Along the optical axis, (H, W) float32; infinite for the sky.
        sightings: Instances of which pixels show, nearest first.
        lanes: Lanes within sight, those of the ego first.
    """

    camera: str
    instances: NDArray[np.uint16]
    classes: NDArray[np.uint8]
    depth_m: NDArray[np.float32]
    sightings: tuple[Sighting, ...]
    lanes: tuple[ImageLane, ...]


@dataclass(frozen=True)
class CameraImages:
    """Pictures of all cameras of a rig at one instant. Rendered, never photographed.

    Attributes:
        images: One a camera, in the rig's order.
        truth: One a camera where it was asked for, else empty.
        cameras: The cameras, in the same order.
        conditions: Weather and light.
        seed: Of the place.
        look: Name of palette, exposure and lens.
        engine: What rendered them.
    """

    images: tuple[CameraImage, ...]
    truth: tuple[ImageTruth, ...]
    cameras: tuple[Camera, ...]
    conditions: Conditions
    seed: int
    look: str
    engine: str

    def __getitem__(self, camera: str) -> CameraImage:
        """The picture of a camera. Raises KeyError."""
        for image in self.images:
            if image.camera == camera:
                return image
        raise KeyError(camera)
