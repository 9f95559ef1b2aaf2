"""The suite on disk: cases are played, many in one drive, and a row is written for each. The same command goes on."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final

from chauffeur.bench.chaos.case_player import Play, Trace, silent
from chauffeur.bench.chaos.cases import BY_NAME, SUITE_VERSION, ChaosCase, Cost, FaultKind, Surroundings, draw, kind_of
from chauffeur.bench.chaos.model import ModelServer, Script
from chauffeur.bench.chaos.outside import OutsideDrive, settings_for
from chauffeur.bench.chaos.replies import WISHES
from chauffeur.bench.chaos.witness import Witness
from chauffeur.bench.kernel.progress import Speedometer, Standing
from chauffeur.bench.kernel.store import Row, RowStore, freeze, sole_writer
from chauffeur.concept import ConfigError, SandboxError
from chauffeur.drive.live.settings import Settings
from chauffeur.drive.live.starts import Start
from chauffeur.worlds.highway.scenarios import BUILT_IN

A_DRIVE: Final[dict[Cost, int]] = {"light": 120, "heavy": 4, "outage": 1, "fatal": 1}
"""Cases played in one drive at most, by what they cost."""
TRIES: Final = 6
"""How often a case whose fault could not strike, or whose reports were lost, is played again."""
_DT_S: Final = 0.1
_POLL_S: Final = 0.004
_FAILURES: Final = 5
"""Drives that may fail to start before the run gives up."""
_ANSWERS_WITHIN_S: Final = 3.0
_STALLED_S: Final = 20.0
_PATIENCE: Final = 20
"""Trips after which a drive is not waited for any more."""
_NOBODY: Final = -1
"""Number of the case that is none: of the wish that warms up."""

WARM_UP: Final = Start(BUILT_IN[2], BUILT_IN[2].seed, most_s=10.0)
"""The first trip of a drive, and the last, which are no cases: nothing is measured while processes begin or end."""

Watch = Callable[[Standing], None]


@dataclass(frozen=True, slots=True)
class ChaosConfig:
    """What decides a run.

    Attributes:
        cases: How many.
        first: Seed of the suite.
        kinds: Only these kinds of fault; all for none.
        speed: Vehicle time per time of the clock.
        realtime: Whether control asks for real-time scheduling.
    """

    cases: int = 1010
    first: int = 0
    kinds: tuple[str, ...] = ()
    speed: float = 5.0
    realtime: bool = True

    @property
    def deck(self) -> tuple[FaultKind, ...]:
        """The kinds, empty for all. Raises ConfigError for an unknown one."""
        unknown = [name for name in self.kinds if name not in BY_NAME]
        if unknown:
            raise ConfigError(f"Unknown kind of fault: {', '.join(unknown)}.", hint=f"There are: {', '.join(BY_NAME)}.")
        return tuple(BY_NAME[name] for name in self.kinds)

    def draw(self, number: int) -> ChaosCase:
        """A case. Raises ConfigError as `deck`."""
        return draw(number, self.first, self.deck)


class ChaosRun:
    """One run of the suite in one folder."""

    def __init__(self, folder: Path, config: ChaosConfig) -> None:
        """Open or continue a run. Raises ConfigError: the folder holds a run with another configuration."""
        self.folder, self.config = folder, config
        self._kinds = [kind_of(number, config.deck) for number in range(config.cases)]
        self._store = RowStore(folder / "cases.jsonl", "case")
        self._tries: dict[int, int] = {}
        self._speed = Speedometer()
        self._fresh = 0
        self._failures = 0
        self._freeze()

    @property
    def left(self) -> list[int]:
        """Numbers of cases that have not been played."""
        return [
            number
            for number in range(self.config.cases)
            if str(number) not in self._store.rows and self._tries.get(number, 0) < TRIES
        ]

    def run(self, watch: Watch, trace: Trace = silent) -> list[Row]:
        """Play what has not been played; what was played stays when this is broken off."""
        with sole_writer(self.folder):
            try:
                with ModelServer() as server, Witness() as witness:
                    while left := self.left:
                        numbers = compose(left, self._kinds)
                        self._play([self.config.draw(number) for number in numbers], server, witness, watch, trace)
            finally:
                self._store.close()
            return self.rows()

    def rows(self) -> list[Row]:
        """Rows of the cases that were played, in order."""
        known = self._store.rows
        return [known[str(number)] for number in range(self.config.cases) if str(number) in known]

    def _freeze(self) -> None:
        content = (json.dumps({**asdict(self.config), "suite": SUITE_VERSION}, indent=1) + "\n").encode()
        freeze(self.folder / "config.json", content, same=lambda stored: _but_cases(stored) == _but_cases(content))

    def _play(
        self, cases: Sequence[ChaosCase], server: ModelServer, witness: Witness, watch: Watch, trace: Trace
    ) -> None:
        for case in cases:
            self._tries[case.number] = self._tries.get(case.number, 0) + 1

        def keep(row: Row) -> None:
            self._store.append(row | {"suite": SUITE_VERSION, "tries": self._tries[row["case"]]})
            self._fresh += 1
            watch(self._standing())

        try:
            play_drive(cases, self.config, server, witness, keep, trace)
        except SandboxError as error:
            self._failures += 1
            trace(str(error))
            if self._failures > _FAILURES:
                raise
            for case in cases:  # it was not their fault
                self._tries[case.number] -= 1

    def _standing(self) -> Standing:
        rate = self._speed.rate(time.monotonic(), self._fresh)
        done = len(self.rows())
        left = self.config.cases - done
        return Standing(
            planned=self.config.cases,
            done=done,
            rate=rate,
            eta_s=left / rate if rate > 0.0 else None,
        )


def compose(left: Sequence[int], kinds: Sequence[FaultKind]) -> list[int]:
    """Cases for the next drive: of the same surroundings as the first that is left, what ends it last.

    Args:
        left: Numbers of cases.
        kinds: Kinds of all cases, by number.
    """
    where: Surroundings = kinds[left[0]].surroundings
    fitting = [number for number in left if kinds[number].surroundings == where]
    by_cost = {
        cost: [number for number in fitting if kinds[number].cost == cost][:most] for cost, most in A_DRIVE.items()
    }
    light, heavy = by_cost["light"], by_cost["heavy"]
    between = max(1, len(light) // (len(heavy) + 1))
    mixed: list[int] = []
    for place, number in enumerate(light):
        mixed.append(number)
        if (place + 1) % between == 0 and heavy:  # what was started anew gets the time to be ready
            mixed.append(heavy.pop(0))
    return mixed + heavy + by_cost["outage"] + by_cost["fatal"]


def play_drive(
    cases: Sequence[ChaosCase],
    config: ChaosConfig,
    server: ModelServer,
    witness: Witness,
    keep: Callable[[Row], None],
    trace: Trace = silent,
) -> None:
    """Play cases in one drive, a trip each; hand over a row for each whose fault struck.

    Raises:
        SandboxError: The drive could not be started.
    """
    surroundings = cases[0].kind.surroundings
    starts = (WARM_UP, *(Start(case.scenario, case.seed, most_s=case.most_s) for case in cases), WARM_UP)
    settings = Settings(
        starts,
        planner="openai/chaos",
        base_url=server.url,
        memory="vault",
        setting="zero-shot",
        speed=config.speed,
        realtime=config.realtime,
    )
    with OutsideDrive(settings_for(settings, surroundings), surroundings) as drive:
        _Stage(cases, starts, drive, server, witness, _DT_S / config.speed, trace).play(keep)


class _Stage:
    """All cases of one drive."""

    def __init__(
        self,
        cases: Sequence[ChaosCase],
        starts: Sequence[Start],
        drive: OutsideDrive,
        server: ModelServer,
        witness: Witness,
        period_s: float,
        trace: Trace,
    ) -> None:
        self._drive, self._period_s, self._trace = drive, period_s, trace
        self._starts = starts[1:-1]
        self._plays = [Play(case, trip, drive, server, trace) for trip, case in enumerate(cases, start=2)]
        self._warmed = False
        self._server = server
        self._witness = witness
        self._plans: set[str] = set()
        self._done: set[int] = set()
        self._present: Play | None = None
        self._last_s = time.monotonic()

    def play(self, keep: Callable[[Row], None]) -> None:
        """Go through the trips."""
        drive = self._drive
        while True:
            self._hear()
            present = self._present
            if present is not None:
                present.breathe()
                if present.struck_ns and present.case.kind.cost == "fatal":
                    break
            self._hand_over(keep, final=False)
            if not drive.running or self._plays[-1].ended:
                break
            if time.monotonic() - self._last_s > _STALLED_S and not drive.processes().get("control"):
                break
            time.sleep(_POLL_S)
        if self._present is not None and self._present.struck_ns and self._present.case.kind.cost == "fatal":
            self._after_the_end(self._present)
        else:
            self._wait_for_answers()
            drive.finish()
        self._hear()
        if self._present is not None:
            self._leave(self._present)
        self._hand_over(keep, final=True)

    def _hear(self) -> None:
        for said in self._drive.lines():
            self._line(said)
        self._plans.update(self._drive.started())
        for heard in self._drive.reports():
            self._last_s = time.monotonic()
            if heard.report.trip == 1:
                self._warm_up()
                continue
            if heard.report.trip > len(self._plays) + 1:
                continue
            play = self._plays[heard.report.trip - 2]
            if play is not self._present:
                self._turn_to(play)
            play.report(heard)

    def _warm_up(self) -> None:
        if not self._warmed:
            self._warmed = True
            self._server.script = Script(good=dict(WISHES["highway"]))
            self._drive.ask(WISHES["highway"][-1][0], _NOBODY)

    def _turn_to(self, play: Play) -> None:
        if self._present is not None:
            self._leave(self._present)
        self._present = play
        if play.case.kind.family == "memory":
            self._drive.scribble("remember", 0, 0.0)
        self._drive.forget_replies()
        case = play.case
        self._trace(f"case {case.number}: {case.kind.name} at stage {case.stage}, {case.scenario.id}")
        play.begin()

    def _leave(self, play: Play) -> None:
        play.calm()
        play.ended = True
        play.notes["hits"] = self._server.script.hit

    def _line(self, said: dict[str, Any]) -> None:
        if "asked" in said:
            for play in self._plays:
                if play.case.number == said["of"]:
                    play.line(said)
        elif "event" in said:
            event = said["event"]
            for play in self._plays:
                play.line(said)
                if said["final"]:
                    play.answer(event["wish"], event["kind"])
        elif "replaced" in said and self._present is not None:
            self._present.replaced.append(said["replaced"])
            self._trace(f"     the {said['replaced']} process was replaced: {said['why']}")

    def _wait_for_answers(self) -> None:
        until_s = time.monotonic() + _ANSWERS_WITHIN_S
        while time.monotonic() < until_s and not all(play.answered for play in self._plays):
            self._hear()
            time.sleep(_POLL_S)

    def _after_the_end(self, play: Play) -> None:
        """Control or the supervisor was killed: what is left has to end by itself."""
        drive = self._drive
        until_s = time.monotonic() + 60.0
        if play.case.kind.name == "control-killed":
            while drive.running and time.monotonic() < until_s:
                self._hear()
                time.sleep(_POLL_S)
            self._hear()
            over = next((said for said in drive.said if said.get("over")), None)
            told = None if over is None else (over["at_ns"] - play.struck_ns) * 1e-9
            play.notes["told_after_s"] = None if told is None else round(told, 4)
        else:
            while not play.ended and time.monotonic() < until_s:
                self._hear()
                alive = drive.processes_left()
                if "control" not in alive:
                    break
                time.sleep(_POLL_S)
        play.notes["orphans"] = list(drive.wait_gone())
        self._hear()
        play.notes["memory_left"] = drive.shared.exists()
        if play.case.kind.name == "supervisor-killed":
            recorded = drive.records()
            # Earlier cases of this drive have had no further chance to get an answer either.
            for one in (one for each in self._plays for one in each.asked if not one.answers):
                if one.name in recorded:
                    one.answers.append("in the audit log")
                elif not one.name:
                    one.answers.append("never taken")  # the host was dead, and whoever asked knows

    def _hand_over(self, keep: Callable[[Row], None], *, final: bool) -> None:
        for place, play in enumerate(self._plays):
            if play.trip in self._done or not play.ended:
                continue
            if not final and not play.answered:
                continue
            settled = final or self._recovered(place)
            if not settled:
                continue
            self._done.add(play.trip)
            if not play.struck or not play.asked or not play.whole:
                self._trace(f"case {play.case.number} was not played whole; it is tried again")
                continue
            later = [heard for other in self._plays[place + 1 :] for heard in other.heard]
            keep(play.row(self._starts[place], self._plans, self._period_s, later, self._witness))

    def _recovered(self, place: int) -> bool:
        """Whether fresh wishes are followed again, or many more trips have passed."""
        ends = [each for other in self._plays[place : place + _PATIENCE] for each in other.heard[-3:]]
        if any(each.at_ns > self._plays[place].struck_ns and each.report.level == "follow" for each in ends):
            return True
        return any(other.ended for other in self._plays[place + _PATIENCE : place + _PATIENCE + 1])


def replay(config: ChaosConfig, number: int, trace: Trace) -> Row | None:
    """Play one case alone, with a trace; its row, or None where its fault could not strike."""
    rows: list[Row] = []
    with ModelServer() as server, Witness() as witness:
        case = config.draw(number)
        play_drive([case], replace(config), server, witness, rows.append, trace)
    return rows[0] if rows else None


def _but_cases(stored: bytes) -> dict[str, Any]:
    """A configuration without the number of cases: more of the same suite may follow."""
    return {name: value for name, value in json.loads(stored).items() if name != "cases"}
