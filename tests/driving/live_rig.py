"""A policy process on a table, beside a control process."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from live_bench import OVERTAKE, Bench

from chauffeur.concept import Plan, Policy, Program, Thoughts, Verdict
from chauffeur.driving.events import DriveEvent
from chauffeur.driving.live.messages import LiveSetpoints, MirroredInstant, Report
from chauffeur.driving.live.mirror import Mirror
from chauffeur.driving.live.plan_messages import PlanMessage, PlannedScene, encode, read_event
from chauffeur.driving.live.policy import Policy as PolicyProcess
from chauffeur.driving.live.policy import PolicyRings
from chauffeur.driving.live.ring import Reader, Ring
from chauffeur.driving.live.settings import SIZES, RingName
from chauffeur.driving.live.starts import Start
from chauffeur.programs import Sandbox


class Rig:
    """Control and policy side by side, period by period."""

    def __init__(self, folder: Path, sandbox: Sandbox, starts: tuple[Start, ...] = (OVERTAKE,)) -> None:
        self.bench = Bench(folder, starts)
        names: tuple[RingName, ...] = ("orders", "policy_events", "checkpoints")
        orders, events, checkpoints = (Ring(folder / name, *SIZES[name], create=True) for name in names)
        self.orders, self.events = orders, events
        self.rings = PolicyRings(orders, self.bench.setpoints, events, checkpoints)
        self.starts, self.sandbox = starts, sandbox
        self.policy = self.new_policy()
        self.bench.control.begin_trip()
        self.reports: list[Report] = []
        self._heard = Reader(self.events, old=True)
        self.verdicts: list[Verdict] = []

    def new_policy(self) -> PolicyProcess:
        mirror = Mirror(self.bench.new_world().mirror(), self.starts, self.bench.observations)
        return PolicyProcess(mirror, self.rings, self.sandbox, clock_ns=lambda: self.bench.now_ns)

    def period(self, count: int = 1) -> LiveSetpoints:
        """Let both run; the policy's last wish."""
        for _ in range(count):
            self.policy.tick()
            self.reports.append(self.bench.tick())
        message = self.bench.setpoints.latest()
        assert message is not None
        return LiveSetpoints.decode(message.payload)

    def order(self, asked: str | Policy, wish: str = "w1", **changes: object) -> None:
        """A plan, made for the present instant: the text of a program, or another policy."""
        observation = self.bench.world.observe()
        message = self.bench.observations.latest()
        assert message is not None
        seen = MirroredInstant.decode(message.payload)
        made = PlanMessage(
            wish,
            Plan(Thoughts("As you wish."), Program(asked) if isinstance(asked, str) else asked),
            PlannedScene.of(seen.trip, observation),
            self.bench.now_ns,
            self.bench.now_ns + 10**10,
            self.bench.now_ns + 10**12,
        )
        self.orders.write(encode(replace(made, **changes)))  # pyright: ignore[reportArgumentType]

    def die(self) -> None:
        """The policy process ends, and another one takes its place."""
        self.policy.close()
        self.policy = self.new_policy()

    def told(self) -> list[DriveEvent]:
        """What became of wishes since the last look; the verdicts of that time are in `verdicts`."""
        events = [read_event(message.payload) for message in self._heard.news()[0]]
        self.verdicts = [
            one for event in events if isinstance(event.value, tuple) for one in event.value if isinstance(one, Verdict)
        ]
        return [event for event in events if event.kind != "verdicts"]

    def kinds(self) -> list[tuple[str, str]]:
        return [(event.kind, event.wish) for event in self.told()]
