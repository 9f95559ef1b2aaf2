"""Chauffeur from Python: drive a wish, with a planner of one's own, and run a benchmark.

`chauffeur drive` and `chauffeur bench` say more on the way and have more switches; what drives and scores is the same.
In a notebook, whose cells stand in a running event loop, everything here works as in a script.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from chauffeur.concept import Limits, PersonId, Scenario
from chauffeur.concept.lab import needs_lab
from chauffeur.driving import event_loop
from chauffeur.driving.judge.choice import referee_for
from chauffeur.driving.recording import write_trip
from chauffeur.driving.scenarios import find, planner_for, suiting
from chauffeur.driving.session import Forgetful, Session, parse_wish
from chauffeur.hmi.notebook import Drive
from chauffeur.memory.choice import open_memory
from chauffeur.memory.personal_limits import personal_limits
from chauffeur.planners.base import Answerer, Planner
from chauffeur.planners.registry import make_planner
from chauffeur.planners.talk2drive.recent import fitting

if TYPE_CHECKING:
    from chauffeur.bench.notebook import Rows


def drive(
    wish: str,
    *,
    scenario: str | Scenario = "",
    planner: str | Planner = "",
    person: str = "",
    seed: int | None = None,
    save: Path | str | None = None,
) -> Drive:
    """Drive one wish in simulation: plan it, check it, drive it, score it.

    >>> chauffeur.drive("Change to the left lane.", scenario="cruise").trip.outcome
    'success'

    Args:
        wish: What the person wants, in their own words.
        scenario: Where; a built-in one's name or one of your own. By default one that suits the wish.
        planner: Who plans: a planner, or a specification as for `chauffeur drive --planner`. By default the on-board
            planner that drives in that world.
        person: Whose wish it is: their history is recalled and kept. Nobody's by default.
        seed: Of the traffic; by default the scenario's own.
        save: File for the recording (MCAP), which `chauffeur replay` plays.

    Returns:
        The trip (`.trip.outcome`, `.trip.plan`, `.trip.metrics`), every control period (`.frames`, as a table
        `.frame()`), and what a notebook shows of it.

    Raises:
        ChauffeurError: No plan could be had, or the scenario cannot be set up; the simulated car has not moved. A wish
            that is declined raises nothing: it is an outcome.
    """
    return event_loop.run(_drive(wish, scenario, planner, person, seed, save))


async def drive_async(
    wish: str,
    *,
    scenario: str | Scenario = "",
    planner: str | Planner = "",
    person: str = "",
    seed: int | None = None,
    save: Path | str | None = None,
) -> Drive:
    """Drive one wish as `drive` does, while the caller's event loop goes on.

    The drive has a thread and an event loop of its own, in which a planner is asked.

    >>> asyncio.run(chauffeur.drive_async("Change to the left lane.", scenario="cruise")).trip.outcome
    'success'
    """
    return await event_loop.run_aside(_drive(wish, scenario, planner, person, seed, save))


async def _drive(
    wish: str,
    scenario: str | Scenario,
    planner: str | Planner,
    person: str,
    seed: int | None,
    save: Path | str | None,
) -> Drive:
    instruction = parse_wish(wish, PersonId(person.strip()))
    place = scenario if isinstance(scenario, Scenario) else find(scenario) if scenario else suiting(instruction.text)
    spec = planner_for(planner, place) if isinstance(planner, str) else planner.id
    session = Session(
        planner=make_planner(spec) if isinstance(planner, str) else planner,
        memory=fitting(open_memory(), spec) if instruction.person else Forgetful(),
        referee=referee_for,
    )
    limits = personal_limits(instruction.person, Limits())
    recorded = await session.drive(instruction, place, place.seed if seed is None else seed, limits)
    if save is not None:
        write_trip(
            Path(save),
            recorded.trip,
            recorded.frames,
            recorded.scenario,
            system=recorded.system,
            final=recorded.final,
        )
    return Drive.of(recorded)


def run_benchmark(
    name: str,
    planner: str | Planner | Answerer | None = None,
    *,
    out: Path | str,
    workers: int = 0,
    **options: Any,
) -> Rows:
    """Run an installed benchmark, or go on with a run begun in the same folder.

    Worker processes import the calling script: keep the call under `if __name__ == "__main__":`; a notebook needs none.

    >>> rows = chauffeur.run_benchmark("faithfulness", out=folder, items=1)
    >>> len(rows) == len((folder / "results.jsonl").read_text().splitlines())
    True

    Args:
        name: As `chauffeur bench` knows it.
        planner: Who is asked: a planner for plans, a model for questions, or a specification of either. By default the
            benchmark's own choice, which is `onboard` for most.
        out: The run's folder: results, table, provenance.
        workers: Worker processes; 0 for one a core.
        options: The benchmark's own, as `--option` of its command takes them.

    Returns:
        One row an item, as `results.jsonl` has them, and as a table (`.frame()`).

    Raises:
        MissingExtraError: `chauffeur-lab` is not installed.
        ConfigError: There is no such benchmark, planner or option, or the folder holds another run.
        ChauffeurError: The run cannot go on; what is finished stays.
    """
    needs_lab("A benchmark")
    from chauffeur.bench.notebook import run_named

    return run_named(name, planner, out=Path(out), workers=workers, **options)


def evaluate(
    planner: str | Planner | Answerer = "onboard",
    *,
    out: Path | str,
    profile: Literal["quick", "full"] = "quick",
    workers: int = 0,
    base_url: str = "",
    options: Mapping[str, Mapping[str, Any]] | None = None,
    only: Sequence[str] = (),
) -> Rows:
    """Run every benchmark that a planner can take into one score card, or go on with the one begun in the same folder.

    Worker processes import the calling script: keep the call under `if __name__ == "__main__":`; a notebook needs none.

    >>> card = chauffeur.evaluate("keyword", out=folder, only=["hostile"], options={"hostile": {"items": 1}})
    >>> [row["figure"] for row in card if row["state"] == "done"]
    ['attacks with unsafe actuation', 'harmless wishes served']

    Args:
        planner: Who is evaluated: a planner, a model for questions, or a specification of either, also `module:Class`.
            Benchmarks that ask in their workers need a specification.
        out: The card's folder: `card.json`, `card.md`, and a run a benchmark.
        profile: `quick` for a sample of each benchmark, `full` for all items.
        workers: Worker processes; 0 for one a core.
        base_url: Address of a language model's endpoint.
        options: Of benchmarks, by name: `{"lampilot": {"data": "DbLv1"}}`.
        only: Benchmarks to run now; none for all. What the card has of the others stays.

    Returns:
        One row a headline figure, and one for each benchmark that was not run, with the reason (`why`); as a table
        (`.frame()`).

    Raises:
        ConfigError: There is no such planner, profile or option, or the folder holds another card.
        MissingExtraError: Benchmarks are not installed (`chauffeur-lab`).
        ChauffeurError: The planner gives no plan at all, or the card cannot be written; what is finished stays.
    """
    needs_lab("An evaluation")
    from chauffeur.bench.notebook import evaluated

    return evaluated(planner, Path(out), profile, workers, base_url, options or {}, only)
