"""Trying again: bounded, with growing jittered waits, and never sooner than the server asked for."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

from chauffeur.planners.llm_errors import EndpointError

if TYPE_CHECKING:
    import numpy as np

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class RetryPolicy:
    """Attempts and waits of one request.

    Attributes:
        attempts: Requests at most, the first included.
        base_s: Wait before the second attempt; doubles each time.
        cap_s: Longest wait of our own choosing.
        patience_s: Longest sum of all waits, the server's wishes included; beyond it the plan fails.
    """

    attempts: int = 4
    base_s: float = 0.5
    cap_s: float = 8.0
    patience_s: float = 60.0

    def wait_s(self, attempt: int, asked_s: float | None, rng: np.random.Generator) -> float:
        """Seconds to wait after failed attempt number `attempt` (from 0).

        Jitter only ever adds to what the server asked for, so a fleet does not come back in the same instant.
        """
        own_s = min(self.cap_s, self.base_s * 2.0**attempt)
        if asked_s is None:
            return own_s * float(rng.uniform(0.5, 1.0))
        return asked_s + min(own_s, self.base_s) * float(rng.uniform(0.0, 1.0))


async def with_retries(
    call: Callable[[], Awaitable[T]],
    policy: RetryPolicy,
    rng: np.random.Generator,
    sleep: Callable[[float], Awaitable[None]],
) -> T:
    """The call's result, trying again after failures that may pass.

    Raises:
        EndpointError: The last failure, when it cannot pass, or when attempts or patience are used up.
    """
    waited_s = 0.0
    attempt = 0
    while True:
        try:
            return await call()
        except EndpointError as error:
            failure = error
        attempt += 1
        if not failure.retryable:
            raise failure
        if attempt >= policy.attempts:
            raise failure.after(attempt)
        wait_s = policy.wait_s(attempt - 1, failure.retry_after_s, rng)
        if waited_s + wait_s > policy.patience_s:
            raise failure.after(attempt, next_wait_s=wait_s)
        waited_s += wait_s
        await sleep(wait_s)
