"""Learning from a critic (paper Sec. IV-A, the human-feedback rows of Tab. IV).

For each item: the model writes a program, it is checked and driven, and a critic says how it was. Words of critique go
back to the model, with the last program, the command, the situation, and the programs of the repository that are
nearest to command and critique. When the critic is content, the model describes the program, and it joins the
repository, where the next items find it. Every attempt is on disk before the next begins.
"""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
import json
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

from pydantic import TypeAdapter

from chauffeur.bench.kernel.store import Row, RowStore, StorageError, sole_writer
from chauffeur.bench.lampilot.critic import Attempt, Critic, CriticJudgement
from chauffeur.bench.lampilot.description import FALLBACK_WORDS, usable_description
from chauffeur.bench.lampilot.policy_aid import offer
from chauffeur.concept import (
    ChauffeurError,
    Context,
    DataError,
    Instruction,
    Limits,
    Plan,
    PlannerError,
    Program,
    ProgramError,
    Round,
    SandboxError,
    Usage,
)
from chauffeur.describe import describe
from chauffeur.driving.episode import drive_program, make_world
from chauffeur.driving.judge.choice import referee_for
from chauffeur.driving.planning import Planned, checked, screened_request
from chauffeur.driving.recording import RecordedTrip
from chauffeur.driving.trips import make_trip, scenario_hash
from chauffeur.memory.policies import CRITIC_LABELS, PolicyRepository
from chauffeur.memory.policies_entry import Describer, Judge, PolicyEntry, content_id, fitting_name
from chauffeur.planners.base import Planner, Writer
from chauffeur.planners.prompts import COACHED_PROMPT_VERSION, description_messages
from chauffeur.planners.prompts.blocks import FEEDBACK_CHARS
from chauffeur.programs.library import function_names, main_name, standalone
from chauffeur.worlds.highway.dblv1 import Dataset, Item

COACHING_VERSION = "lampilot-coaching-v1"

DEMO_ITEMS = (
    "dec_abs_dis25_s1_c0", "dec_abs_speed10_s0_c0", "dec_rel_dis15_s1_c0", "dec_rel_speed6_s0_c0", "go_straight_s1_c0",
    "left_lc_s0_c0", "right_lc_s0_c0", "left_overtake_s0_c0", "right_overtake_s0_c0", "turn_left_s1_c0",
    "turn_right_s1_c0", "pull_over_s0_c5",
)  # fmt: skip
"""The twelve items that LaMPilot's own human-feedback rows were coached on. They are also among the items scored."""

MAX_EPISODE_S = 1000.0
"""LaMPilot's own bound; each road ends its episodes earlier."""

_CRITIQUES = 10
"""Critiques kept with a program; the last ones, which brought it about."""

_plan_adapter: TypeAdapter[Plan] = TypeAdapter(Plan)

Ending = Literal["kept", "not_kept", "skipped", "given_up", "failed"]
"""Ending of an item: `given_up` after all rounds, `failed` for want of a plan or a sample."""

Tell = Callable[[str, Any], None]
"""Called with (`item`, Item), (`asking`, round), (`attempt`, Attempt), (`judged`, Judgement), (`ended`, Coached)."""


@dataclass(frozen=True, slots=True)
class Coached:
    """Outcome of coaching on one item.

    Attributes:
        item: Its id.
        ending: How it ended.
        rounds: Attempts made, earlier sessions included.
        kept: Name of the program in the repository; empty without one.
        detail: Why not, in words.
        before: Whether it was done before this session.
    """

    item: str
    ending: Ending
    rounds: int
    kept: str = ""
    detail: str = ""
    before: bool = False


def items_named(dataset: Dataset, ids: Sequence[str]) -> tuple[Item, ...]:
    """Items by id, in the order given. Raises DataError naming those that the data does not hold."""
    known = {item.id: item for item in dataset.items()}
    missing = [one for one in ids if one not in known]
    if missing:
        raise DataError(
            f"The data in {dataset.path} holds no item {', '.join(missing[:5])}.",
            hint="Items are called <task>_s<sample>_c<command>, e.g. left_lc_s0_c0.",
        )
    return tuple(known[one] for one in ids)


def fallback_description(command: str) -> tuple[str, Describer]:
    """A description where no model gave a usable one, and its describer."""
    return FALLBACK_WORDS.format(command=command[:400]), "fallback"


def learned_entry(
    plan: Plan,
    command: str,
    context: Context,
    describe_program: Callable[[str], tuple[str, Describer]],
    *,
    scenario: str,
    item: str,
    judge: Judge,
    critiques: Sequence[str],
    learned: datetime,
    outcome: str = "success",
    metrics: tuple[tuple[str, float], ...] = (),
) -> PolicyEntry:
    """An entry for a plan's program that did well, with the library functions that it calls written into it.

    Args:
        plan: Holds the program.
        command, context: What was wished, and the situation then.
        describe_program: Gives the description of the entry's source, and its describer.
        scenario, item: Where it was learned.
        judge: Who said that it did well.
        critiques: What was said of the attempts before; the last ones are kept.
        learned: The present time.
        outcome, metrics: Of its drive.

    Raises:
        ProgramError: The program cannot stand by itself.
    """
    assert isinstance(plan.policy, Program)
    world = context.situation.world
    name = fitting_name(main_name(plan.policy.source), world)
    source = standalone(plan.policy.source, name, plan.policy.library)
    description, by = describe_program(source)
    return PolicyEntry(
        id=content_id(source, command, context.text, scenario, judge, plan.planner, plan.model),
        name=name,
        version=1,
        description=description,
        described_by=by,
        source=source,
        command=command,
        context=context.text,
        world=world,
        scenario=scenario,
        item=item,
        outcome=outcome,
        metrics=metrics,
        judged_by=judge,
        critiques=tuple(words[:FEEDBACK_CHARS] for words in critiques[-_CRITIQUES:]),
        planner=plan.planner,
        model=plan.model,
        learned=learned.isoformat(timespec="seconds"),
        chauffeur=version("chauffeur"),
    )


@dataclass(slots=True)
class Coach:
    """One coaching of a model.

    Attributes:
        folder: Where its attempts are kept; the same folder goes on where it stopped.
        planner: The model.
        repository: Where programs go.
        critic: Who judges.
        limits: Bounds for the checks.
        rounds: Attempts at most for each item.
        tell: Is told of everything as it happens.
        now: Clock of the entries.
    """

    folder: Path
    planner: Planner
    repository: PolicyRepository
    critic: Critic
    limits: Limits
    rounds: int = 5
    tell: Tell = lambda _event, _value: None
    now: Callable[[], datetime] = lambda: datetime.now(UTC)
    _log: RowStore = field(init=False)

    def coach(self, items: Sequence[Item]) -> tuple[Coached, ...]:
        """Go through the items, one after the other, until the critic stops or all are done.

        An interrupt (KeyboardInterrupt) leaves what is finished on disk, the attempt that waits for its judgement
        included.

        Raises:
            ChauffeurError: The folder or the repository cannot be written.
        """
        done: list[Coached] = []
        store = RowStore(self.folder / "coaching.jsonl", "key")
        # One event loop for all calls, so that connections are kept; between them nothing of asyncio is in the way of
        # a person's Ctrl-C.
        with sole_writer(self.folder), store as self._log, asyncio.Runner() as runner:
            try:
                for item in items:
                    ended = self._ended(item)
                    if ended is None:
                        self.tell("item", item)
                        ended = self._item(item, runner)
                    if ended is None:
                        break
                    self.tell("ended", ended)
                    done.append(ended)
            finally:
                runner.run(_close(self.planner))
        return tuple(done)

    def _item(self, item: Item, runner: asyncio.Runner) -> Coached | None:
        """Coach on one item; None when the critic wants to stop."""
        earlier: list[Round] = []
        critiques: list[str] = []
        for number in range(1, self.rounds + 1):
            row = self._log.rows.get(self._key(item, number))
            if row is not None and row["judgement"] == "critique":
                earlier.append(Round(row["program"], row["feedback"]))
                critiques.append(row["words"])
                continue
            try:
                attempt = self._attempt(item, number, earlier, critiques, row, runner)
            except StorageError:
                raise
            except ChauffeurError as error:  # no plan to be had, or the sample cannot be set up: tried again next time
                return Coached(item.id, "failed", number - 1, detail=str(error))
            self.tell("attempt", attempt)
            judgement = self.critic.judge(attempt)
            self.tell("judged", judgement)
            match judgement.kind:
                case "stop":
                    return None
                case "skip":
                    self._judged(item, number, judgement)
                    return self._close(item, number, "skipped", detail=judgement.words)
                case "keep":
                    return self._keep(attempt, critiques, judgement, runner)
                case "critique":
                    program, feedback = _program_text(attempt), self._feedback(attempt, judgement)
                    self._judged(item, number, judgement, program=program, feedback=feedback)
                    earlier.append(Round(program, feedback))
                    critiques.append(judgement.words)
        return self._close(item, self.rounds, "given_up", detail=critiques[-1] if critiques else "")

    def _attempt(
        self,
        item: Item,
        number: int,
        earlier: Sequence[Round],
        critiques: Sequence[str],
        pending: Row | None,
        runner: asyncio.Runner,
    ) -> Attempt:
        """Ask for a program and drive it; a program that only waits for its judgement is driven again, not asked for.

        Raises:
            PlannerError: There is no plan to be had.
            ChauffeurError: The sample cannot be set up, or the sandbox is gone.
        """
        world = make_world(item.scenario)
        observation = world.reset(item.scenario)
        context = describe(observation)
        critique = critiques[-1] if critiques else ""
        used = self._used(item, number - 1)
        system, entries = offer(
            self.repository, item.command, observation.kind, self.limits, critique=critique, also=used
        )
        request = screened_request(
            Instruction(item.command, source="benchmark"), context, system, rounds=tuple(earlier), limits=self.limits
        )
        if pending is None:
            self.tell("asking", number)
            plan = runner.run(self.planner.plan(request))
            names = [entry.callable_name for entry in entries]
            self._log.append(self._row(item, number) | {"plan": asdict(plan), "offered": names, "judgement": ""})
        else:
            plan, names = _plan_adapter.validate_python(pending["plan"]), pending["offered"]
        found = checked(plan, observation, self.limits)
        refusal = found.refusal
        if not refusal and not isinstance(plan.policy, Program):
            refusal = "The planner gave no program."
        episode = None
        if not refusal:
            assert isinstance(plan.policy, Program)
            referee = referee_for(world, item.scenario, plan)
            episode = drive_program(world, plan.policy.source, referee, MAX_EPISODE_S, library=plan.policy.library)
            if episode.causes.infra_failed:  # says nothing about the program, so nobody judges it
                raise SandboxError(episode.causes.detail)
        trip = make_trip(Planned(plan, found.verdicts, request), item.scenario, item.scenario.seed, episode, refusal)
        recorded = RecordedTrip(
            trip,
            () if episode is None else episode.frames,
            item.scenario,
            system if pending is None else None,  # what is offered now need not be what was offered then
            None if episode is None else episode.final,
        )
        success = episode is not None and episode.success and episode.outcome == "success"
        return Attempt(item, number, recorded, success, tuple(names))

    def _used(self, item: Item, number: int) -> tuple[str, ...]:
        """Names of the repository's programs that an earlier attempt called; its successor may go on calling them."""
        policy = (self._log.rows.get(self._key(item, number), {}).get("plan") or {}).get("policy") or {}
        return function_names(policy.get("library", ""))

    def _feedback(self, attempt: Attempt, judgement: CriticJudgement) -> str:
        if self.critic.judge_id == "evaluator":
            return f"The evaluator (a program, not a person) says: {judgement.words}"
        if judgement.by_checks:
            return judgement.words
        causes = attempt.recorded.trip.causes
        failed = f"The program failed while it ran: {causes.detail}\n" if causes.policy_failed else ""
        return f"{failed}The passenger says: {judgement.words}"

    def _keep(
        self, attempt: Attempt, critiques: Sequence[str], judgement: CriticJudgement, runner: asyncio.Runner
    ) -> Coached:
        item, number = attempt.item, attempt.number
        try:
            draft, usage = self._entry(attempt, critiques, runner)
            entry = self.repository.commit(draft)
        except ProgramError as error:
            # The drive was good; that its program cannot be offered to others is no reason to ask for another one.
            self._judged(item, number, judgement)
            return self._close(item, number, "not_kept", detail=str(error))
        self._judged(item, number, judgement, policy=entry.id, description_usage=asdict(usage))
        return self._close(item, number, "kept", kept=entry.callable_name)

    def _entry(self, attempt: Attempt, critiques: Sequence[str], runner: asyncio.Runner) -> tuple[PolicyEntry, Usage]:
        """The attempt as an entry, and what its description cost.

        Raises:
            ProgramError: Its program cannot stand by itself.
        """
        trip, item, usage = attempt.recorded.trip, attempt.item, Usage()

        def described(source: str) -> tuple[str, Describer]:
            nonlocal usage
            if isinstance(self.planner, Writer):
                messages = description_messages(item.command, trip.context.text, source)
                with contextlib.suppress(PlannerError):
                    prose = runner.run(self.planner.write(messages))
                    usage = prose.usage
                    if prose.whole and (words := usable_description(prose.text)):
                        return words, "model"
            return fallback_description(item.command)

        entry = learned_entry(
            trip.plan,
            item.command,
            trip.context,
            described,
            scenario=item.scenario.id,
            item=item.id,
            judge=self.critic.judge_id,
            critiques=critiques,
            learned=self.now(),
            outcome=trip.outcome,
            metrics=tuple((m.id, m.value) for m in trip.metrics if m.applies and math.isfinite(m.value)),
        )
        return entry, usage

    # What is on disk -------------------------------------------------------------------------------------------

    @property
    def _session(self) -> str:
        """Settings that decide a coaching; another model, critic, limit or repository begins anew."""
        parts = [
            COACHING_VERSION,
            COACHED_PROMPT_VERSION,
            self.planner.id,
            self.planner.model,
            self.critic.judge_id,
            asdict(self.limits),
            str(self.repository.folder.resolve()),
        ]
        return hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:12]

    def _key(self, item: Item, number: int | str) -> str:
        return f"{self._session}/{scenario_hash(item.scenario)[:12]}/{item.id}/{number}"

    def _row(self, item: Item, number: int | str) -> Row:
        return {
            "key": self._key(item, number),
            "item": item.id,
            "round": number,
            "command": item.command,
            "planner": self.planner.id,
            "model": self.planner.model,
            "critic": self.critic.judge_id,
            "labels": [CRITIC_LABELS[self.critic.judge_id]],
        }

    def _judged(self, item: Item, number: int, judgement: CriticJudgement, **more: Any) -> None:
        row = self._log.rows[self._key(item, number)]
        self._log.append(row | {"judgement": judgement.kind, "words": judgement.words, **more})

    def _close(self, item: Item, rounds: int, ending: Ending, *, kept: str = "", detail: str = "") -> Coached:
        ended = Coached(item.id, ending, rounds, kept, detail)
        self._log.append(self._row(item, "end") | {"ended": asdict(ended), "limit": self.rounds})
        return ended

    def _ended(self, item: Item) -> Coached | None:
        """Ending of an item in an earlier session; None when it did not, or may go on with more rounds."""
        row = self._log.rows.get(self._key(item, "end"))
        if row is None:
            return None
        ended = Coached(**row["ended"] | {"before": True})
        return None if ended.ending == "given_up" and ended.rounds < self.rounds else ended


def _program_text(attempt: Attempt) -> str:
    """P for the next round's eyes: the program, or the model's words where there was none."""
    plan = attempt.recorded.trip.plan
    return plan.policy.source if isinstance(plan.policy, Program) else plan.raw or plan.refusal or "(nothing)"


async def _close(planner: Planner) -> None:
    close = getattr(planner, "close", None)
    if close is not None:
        await close()


def spent(rows: Iterable[Row]) -> Usage:
    """Cost of the plans and descriptions in a coaching's rows."""
    usages = [
        usage for row in rows if row.get("plan") for usage in (row["plan"]["usage"], row.get("description_usage"))
    ]
    usages = [usage for usage in usages if usage and not usage["cached"]]
    prices = [usage["cost_usd"] for usage in usages]
    known = [price for price in prices if price is not None]
    return Usage(
        prompt_tokens=sum(usage["prompt_tokens"] for usage in usages),
        completion_tokens=sum(usage["completion_tokens"] for usage in usages),
        cost_usd=math.fsum(known) if known and len(known) == len(prices) else None,
        requests=sum(usage["requests"] for usage in usages),
    )
