"""Turns a function of numbers and arrays into machine code.

Numba checks only the file a function stands in when it reuses machine code: what a compiled function calls stands in
the same file. IEEE arithmetic, no fast-math: the result is that of the same lines in Python, to the last bit.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numba

_F = TypeVar("_F", bound=Callable[..., Any])
_njit: Any = numba.njit


def compiled(function: _F) -> _F:
    """The function as machine code, made when it is first called and kept for the next process."""
    return _njit(cache=True, error_model="numpy", fastmath=False)(function)
