"""How a mood is said plainly."""

from __future__ import annotations

from typing import Final

HURRY: Final = "I'm in a hurry."
EASE: Final = "Drive calmly, please."
