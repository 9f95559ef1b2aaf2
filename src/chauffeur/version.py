"""The version of this package, apart from its front page, which names what stands on the floors above."""

from typing import Final

__version__: Final = "0.1.0"
