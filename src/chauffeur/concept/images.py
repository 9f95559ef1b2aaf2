"""V: what a camera saw."""

from __future__ import annotations

from dataclasses import dataclass
from io import BytesIO
from typing import TYPE_CHECKING

from chauffeur.concept.errors import ConfigError

if TYPE_CHECKING:  # the command line says hello without NumPy
    import numpy as np
    from numpy.typing import NDArray

    Pixels = NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class CameraImage:
    """A picture of one camera at one instant: V of the paper. Two with the same pixels are equal.

    Attributes:
        camera: Name of the camera, e.g. `front`, `CAM_FRONT`.
        time_s: When, in the time of the observation it belongs to.
        picture: (H, W, 3) uint8, red green blue, top row first; or the bytes of a PNG file.
    """

    camera: str
    time_s: float
    picture: Pixels | bytes

    def pixels(self) -> Pixels:
        """The picture as (H, W, 3) uint8. Raises ConfigError for bytes that are no picture."""
        if not isinstance(self.picture, bytes):
            return self.picture
        import numpy as np
        from PIL import Image, UnidentifiedImageError

        try:
            with Image.open(BytesIO(self.picture)) as image:
                return np.asarray(image.convert("RGB"))
        except (UnidentifiedImageError, OSError) as error:
            raise ConfigError(
                f"The picture of camera {self.camera!r} cannot be read: {error}", hint="Give the bytes of a PNG file."
            ) from error

    def png(self) -> bytes:
        """The picture as a PNG file."""
        if isinstance(self.picture, bytes):
            return self.picture
        from PIL import Image

        file = BytesIO()
        Image.fromarray(self.picture).save(file, format="PNG")
        return file.getvalue()

    def __eq__(self, other: object) -> bool:
        """Same camera, same time, same pixels."""
        if not isinstance(other, CameraImage):
            return NotImplemented
        if (self.camera, self.time_s) != (other.camera, other.time_s):
            return False
        mine, its = self.pixels(), other.pixels()
        return mine.shape == its.shape and bool((mine == its).all())

    def __hash__(self) -> int:
        """By camera and time."""
        return hash((self.camera, self.time_s))
