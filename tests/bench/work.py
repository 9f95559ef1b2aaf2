"""Things for a worker process to do, the bad ones included."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path
from typing import Any


def echo(job: Any) -> dict[str, Any]:
    return {"job": job, "pid": os.getpid()}


def nap(job: float) -> dict[str, Any]:
    time.sleep(job)
    return {"slept": job}


def fail(job: str) -> dict[str, Any]:
    raise ValueError(job)


class Poison:
    """Ends whoever unpacks it, before there is anything to do."""

    def __reduce__(self) -> Any:
        return os._exit, (3,)


def die(job: str) -> dict[str, Any]:
    """Takes its worker with it as often as the file named says."""
    path = Path(job)
    left = int(path.read_text())
    if left:
        path.write_text(str(left - 1))
        os.kill(os.getpid(), signal.SIGKILL)
    return {"survived": True, "pid": os.getpid()}
