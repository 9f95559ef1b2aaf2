"""A wall clock that jumps: put this folder on PYTHONPATH, and `time.time` goes back and forth by up to a year.

The interpreter loads a module of this name by itself. The monotonic clock is left alone.
"""

import time

_STEP_S = 0.37
_JUMPS_S = (0.0, 3600.0, -86400.0, 31536000.0, -0.5, -3600.0, 86400.0)

_true_time = time.time


def _jumping() -> float:
    return _true_time() + _JUMPS_S[int(time.monotonic() / _STEP_S) % len(_JUMPS_S)]


time.time = _jumping
time.time_ns = lambda: round(_jumping() * 1e9)
