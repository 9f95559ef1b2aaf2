"""Products of two terms, rounded as NumPy's linear algebra rounds them.

Where wrecks touch, the sign of a number that is zero but for rounding decides which way they are pushed, so the core
must round as highway-env does: NumPy's `dot` and `norm` use one fused multiply-add, and so do these. (Its vectorised
`tan`, `arcsin` and `power` on AVX-512 machines differ from the C library's in the last bit; with those switched off,
core and reference agree to the last bit. benchmarks/core_parity.py does so.)
"""

from __future__ import annotations

import math
from typing import Any

from llvmlite import ir
from numba.core import types
from numba.extending import intrinsic

from chauffeur.worlds.highway.core.jit import compiled


def _fused(typing_context: Any, a: Any, b: Any, c: Any) -> Any:
    del typing_context, a, b, c
    double = types.float64

    def generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> Any:
        del context, signature
        return builder.fma(*arguments)

    return double(double, double, double), generate


fused: Any = intrinsic(_fused)
"""a * b + c, rounded once."""


@compiled
def dot(a: float, b: float, c: float, d: float) -> float:
    """a b + c d as `numpy.dot` of two pairs and the product of two matrices round it."""
    return fused(c, d, a * b)


@compiled
def row(a: float, b: float, c: float, d: float) -> float:
    """a b + c d as the product of a matrix and a vector rounds it."""
    return fused(a, b, c * d)


@compiled
def norm(a: float, b: float) -> float:
    """Length of a vector as `numpy.linalg.norm` rounds it."""
    return math.sqrt(fused(b, b, a * a))
