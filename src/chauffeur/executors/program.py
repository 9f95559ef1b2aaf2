"""Drives a `Program`: it states set-points period by period, from its sandbox, and the world's own driver follows."""

from __future__ import annotations

from chauffeur.concept import STOP_ZONE_M, Limits, Observation, Program, VehicleState
from chauffeur.executors.base import DriverLed
from chauffeur.programs import ProgramExecutor
from chauffeur.programs.sandbox import UNHURRIED, Sandbox
from chauffeur.worlds.base import World


class ProgramDrive(DriverLed):
    """A program in simulated time, which waits for it: how busy the machine is must not change a trip."""

    def __init__(self, world: World, *, sandbox: Sandbox | None = None, stop_zone_m: float = STOP_ZONE_M) -> None:
        """Args: the world; a sandbox that is open already, None opens one; how far from its sign a stop serves it."""
        super().__init__(world)
        self._sandbox, self._stop_zone_m = sandbox, stop_zone_m
        self._running: ProgramExecutor | None = None

    def start(
        self, policy: Program, observation: Observation, limits: Limits, origin: VehicleState | None = None
    ) -> None:
        """See Executor. Raises SandboxError: no worker can be had."""
        del observation, origin
        running = ProgramExecutor(
            budget=UNHURRIED, library=policy.library, sandbox=self._sandbox, stop_zone_m=self._stop_zone_m
        )
        try:
            running.start(policy.source, self._world)
        except BaseException:
            running.close()
            raise
        self.close()
        self._running = self._policy = running
        self._limits = limits

    def close(self) -> None:
        if self._running is not None:
            self._running.close()
