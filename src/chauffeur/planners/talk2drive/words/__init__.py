"""What passengers say, as regular expressions in English."""

from typing import Final

WORDS: Final = __name__
"""This package, for who reads its files."""
