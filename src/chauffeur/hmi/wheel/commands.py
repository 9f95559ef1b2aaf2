"""A person's hands as the policy of an episode: each period the latest keys become a command, whatever the page does.

A page that falls silent has let go: after `RELEASE_S` no key counts as held, and the car rolls on with the wheel in
the middle; after `PAUSE_S` the drive pauses until the person is back.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from chauffeur.bench.lampilot.human import HandTrace, Pause
from chauffeur.concept import Command, Observation
from chauffeur.hmi.wheel.controls import Keys, Positions, WheelGains, command_of, moved
from chauffeur.hmi.wheel.mailbox import Mailbox, PageInput
from chauffeur.hmi.wheel.pace import Clock, DrivePace
from chauffeur.worlds.base import EGO, World

RELEASE_S = 0.5
PAUSE_S = 1.5
COUNTDOWN_S = 2.0
"""Between the key that starts a drive, or ends a pause, and the first period driven."""
HANDS_OFF_WHEEL = 0.02
"""The lane-keeping assist steers when no steering key is held and the wheel is within this of the middle."""

Phase = Literal["countdown", "driving", "paused"]


@dataclass(frozen=True, slots=True)
class WheelInstant:
    """What the person is shown of the drive at one instant.

    Attributes:
        observation: The world.
        phase: What the drive does.
        countdown_s: Until it goes on, in a countdown.
        positions: Of wheel and pedals.
        released: The page fell silent and the keys count as released.
        number: The page's number of the latest message that was applied.
        late: Deadlines missed so far.
    """

    observation: Observation
    phase: Phase
    countdown_s: float
    positions: Positions
    released: bool
    number: int
    late: int


class WheelCommands:
    """See `chauffeur.drive.episode.Hands`. Made for one drive, used by one thread; the mailbox is the only way in."""

    def __init__(
        self,
        world: World,
        mailbox: Mailbox,
        clock: Clock,
        show: Callable[[WheelInstant], None],
        *,
        assist: bool = False,
        gains: WheelGains | None = None,
    ) -> None:
        """Sit down at the wheel of a world just reset.

        Args:
            world: The world; it is looked at and never acted on.
            mailbox: What comes from the page.
            clock: The drive's time.
            show: Called with each new instant; must not wait.
            assist: Whether the lane is kept while nobody steers.
            gains: How keys move wheel and pedals.
        """
        self._world = world
        self._mailbox = mailbox
        self._clock = clock
        self._show = show
        self._assist = assist
        self._gains = gains or WheelGains()
        self._pace = DrivePace(clock, world.dt_s)
        self._observation = world.observe()
        self._phase: Phase = "countdown"
        self._until_s = clock.now_s() + COUNTDOWN_S
        self._paused_s = 0.0
        self._why: Literal["asked", "silent"] = "asked"
        self._positions = Positions()
        self._released = False
        self._number = 0
        self._keys: list[int] = []
        self._commands: list[tuple[float, float]] = []
        self._pauses: list[Pause] = []
        self._releases = 0

    def command(self) -> Command | None:
        """See Hands."""
        while True:
            self._tell()
            self._pace.await_period(driven=self._phase == "driving")
            heard = self._mailbox.look()
            if heard.wish == "give_up":
                return None
            if self._phase == "driving":
                if heard.wish == "pause" or heard.silent_s > PAUSE_S:
                    self._pause("asked" if heard.wish == "pause" else "silent")
                else:
                    return self._act(heard)
            elif self._phase == "paused":
                if heard.wish == "go":
                    self._go_on()
            elif heard.wish == "pause":
                self._pause("asked")
            elif self._clock.now_s() >= self._until_s:
                self._phase = "driving"

    def trace(self) -> HandTrace:
        """The drive so far, for replay."""
        return HandTrace(
            period_s=self._world.dt_s,
            keys=tuple(self._keys),
            commands=tuple(self._commands),
            pauses=tuple(self._pauses),
            releases=self._releases,
            late=self._pace.late,
            worst_late_s=round(self._pace.worst_late_s, 4),
            assist=self._assist,
        )

    def _act(self, heard: PageInput) -> Command:
        silent = heard.silent_s > RELEASE_S
        self._releases += silent and not self._released
        self._released = silent
        self._number = heard.number
        keys = Keys.NONE if silent else heard.keys
        dt_s = self._world.dt_s
        self._positions = moved(self._positions, keys, dt_s, self._gains)
        speed_mps = self._world.perception().vehicle(EGO).speed_mps
        command = command_of(self._positions, speed_mps, dt_s, self._gains)
        if self._assist and not keys & (Keys.LEFT | Keys.RIGHT) and abs(self._positions.wheel) < HANDS_OFF_WHEEL:
            command = Command(command.acceleration_mps2, self._lane_keeping_rad())
        self._keys.append(int(keys))
        self._commands.append((command.acceleration_mps2, command.steering_rad))
        return command

    def _lane_keeping_rad(self) -> float:
        """What the world's own driver would steer to stay in the lane the car is in."""
        driver = self._world.driver()
        return driver.command(driver.settle(driver.initial_setpoints())).steering_rad

    def _pause(self, why: Literal["asked", "silent"]) -> None:
        self._phase = "paused"
        self._paused_s = self._clock.now_s()
        self._why = why
        self._released = False

    def _go_on(self) -> None:
        now_s = self._clock.now_s()
        self._pauses.append(Pause(len(self._keys), round(now_s - self._paused_s, 2), self._why))
        self._phase = "countdown"
        self._until_s = now_s + COUNTDOWN_S

    def _tell(self) -> None:
        if self._phase == "driving":
            self._observation = self._world.observe()
        left_s = self._until_s - self._clock.now_s() if self._phase == "countdown" else 0.0
        self._show(
            WheelInstant(
                self._observation,
                self._phase,
                round(max(0.0, left_s), 2),
                self._positions,
                self._released,
                self._number,
                self._pace.late,
            )
        )
