"""Driving by hand over a real server: keys in, rows out, and the same rows again from the trace."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path
from typing import Any

import pytest
from wheel_rig import GAS, LEFT, TowardsLane, TowardsSpeed, at_the_wheel, dataset_of, run_of

from chauffeur.bench.kernel.store import RowStore
from chauffeur.bench.lampilot.human import drive_again
from chauffeur.concept import ConfigError
from chauffeur.hmi.wheel.controls import Keys, Positions, WheelGains, command_of, moved
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway.dblv1 import load_dataset

pytestmark = pytest.mark.server

ABOUT = ("key", "sample", "rollout", "crc32")
"""What a stored rollout row has beside what happened."""


def test_a_lane_change_and_a_speed_by_keys_are_scored_like_any_run_and_replay_to_the_same_rows(tmp_path: Path) -> None:
    dataset = dataset_of(tmp_path / "data", "left_lc", "dec_rel_speed4")
    run = run_of(tmp_path / "run", dataset)
    by_task: dict[str, Any] = {"left_lc": TowardsLane(-4.0), "dec_rel_speed4": TowardsSpeed(-4.0)}

    async def drive() -> list[dict[str, Any]]:
        results: list[dict[str, Any]] = []
        async with at_the_wheel(run) as (page, _, _):
            for _ in range(2):
                await page.start()
                results.append(await page.drive(by_task[page.item["id"].rsplit("_s", 1)[0]]))
                await page.next()
                await page.hear(lambda page: page.stage["stage"] != "result")
            await page.hear(lambda page: page.stage["stage"] == "done")
        return results

    results = asyncio.run(drive())
    assert [r["label"] for r in results] == ["Done as asked", "Done as asked"]
    assert results[1]["driven"] == 2 and results[1]["successes"] == 2

    written = [json.loads(line) for line in (tmp_path / "run" / "results.jsonl").read_text().splitlines()]
    assert [row["item"] for row in written] == [item.id for item in run.items]
    for row in written:
        assert row["schema"] == "lampilot-results-v2" and row["metrics"] == "lampilot-origin-v1"
        assert row["success"] and row["outcome"] == "success" and not row["collision"]
        assert 80 < row["score"] <= 100
        assert row["labels"] == ["human driver (ana)"] and row["planner"] == "human" and row["model"] == "ana"
        assert row["latency_s"] is None and row["prompt_tokens"] is None and row["cost_usd"] is None
        assert row["intent"].startswith("by hand, trace ") and not row["policy_failed"] and not row["fallback_used"]
    assert {"provenance.json", "table.md", "plan.json", "generate.jsonl", "contexts.jsonl"} <= {
        path.name for path in (tmp_path / "run").iterdir()
    }

    # Driving the recorded commands again gives the stored rollout rows, bit for bit.
    stored = RowStore(tmp_path / "run" / "rollout.jsonl", "key").rows
    again = run_of(tmp_path / "run", dataset)
    for item, row in zip(run.items, written, strict=True):
        trace = again.trace(item.id)
        assert trace is not None
        kept = {name: value for name, value in stored[row["rollout_key"]].items() if name not in ABOUT}
        assert drive_again(item.scenario, trace) == kept
        assert len(trace.commands) == row["steps"] and trace.late == 0 and not trace.pauses
        assert keys_to_commands(item.scenario, trace.keys) == trace.commands
    # A lost rollout file costs nothing but the time to drive the traces.
    (tmp_path / "run" / "rollout.jsonl").unlink()
    assert run_of(tmp_path / "run", dataset).score() == written


def keys_to_commands(scenario: Any, keys: tuple[int, ...]) -> tuple[tuple[float, float], ...]:
    """The commands that recorded keys make on the same start."""
    from chauffeur.bench.lampilot.human import drive_by_hand

    world = HighwayWorld()
    world.reset(scenario)
    made: list[tuple[float, float]] = []

    class Typed:
        at = Positions()

        def command(self) -> Any:
            if len(made) == len(keys):
                return None
            self.at = moved(self.at, Keys(keys[len(made)]), 0.1, WheelGains())
            command = command_of(self.at, world.perception().vehicle(0).speed_mps, 0.1, WheelGains())
            made.append((command.acceleration_mps2, command.steering_rad))
            return command

    drive_by_hand(world, scenario, Typed())
    return tuple(made)


def test_a_silent_page_lets_go_of_the_pedals_and_then_pauses_and_the_row_says_so(tmp_path: Path) -> None:
    run = run_of(tmp_path / "run", dataset_of(tmp_path / "data", "dec_rel_speed4"))

    async def drive() -> None:
        async with at_the_wheel(run) as (page, _, clock):
            await page.start()
            for keys in [GAS] * 9 + [GAS | LEFT]:
                await page.period(keys)
            pressed = page.tick
            assert pressed["pedal"] == 1.0 and pressed["wheel"] == -0.16 and not pressed["released"]
            for _ in range(6):  # 0.6 s without a word
                await page.period(None)
            assert page.tick["released"]
            for _ in range(4):
                await page.period(None)
            assert (page.tick["pedal"], page.tick["wheel"]) == (0.0, 0.0)
            rolling = page.tick
            await page.period(None)
            assert page.tick["ego"][3] == rolling["ego"][3], "no pedal, no change of speed"
            for _ in range(8):  # beyond 1.5 s
                await page.period(None)
            assert page.tick["phase"] == "paused"
            standing = page.tick["time"]
            for _ in range(5):
                await page.period(GAS)  # keys do not move a drive that is paused
            assert (page.tick["phase"], page.tick["time"]) == ("paused", standing)
            await page.wish("go")
            clock.advance()
            await page.hear(lambda page: page.tick["phase"] == "countdown")
            assert page.tick["time"] == standing
            await page.until_driving()
            await page.period(0)
            assert page.tick["time"] > standing and not page.tick["released"]
            await page.wish("pause")
            await page.period(0)
            assert page.tick["phase"] == "paused"
            await page.wish("give_up")
            clock.advance()
            await page.hear(lambda page: page.stage["stage"] == "result" and "driven" in page.stage)
            assert page.stage["label"] == "Not done as asked"
            assert page.stage["detail"].startswith("Given up by the driver after")

    asyncio.run(drive())
    trace = run.trace(run.items[0].id)
    assert trace is not None
    assert [(p.why, p.tick) for p in trace.pauses] == [("silent", trace.pauses[0].tick)]
    assert trace.releases == 1
    (row,) = run.score()
    assert row["outcome"] == "failure" and row["policy_failed"] and not row["success"] and row["score"] == 0.0
    assert row["labels"] == ["human driver (ana)"]
    assert row["detail"].startswith("Given up by the driver after") and "Paused once, " in row["detail"]


def test_a_drive_begun_counts_whatever_ends_it(tmp_path: Path) -> None:
    dataset = dataset_of(tmp_path / "data", "left_lc", "dec_rel_speed4", "go_straight")
    run = run_of(tmp_path / "run", dataset)
    first, second, third = run.items

    async def drive() -> None:
        async with at_the_wheel(run) as (page, _, _):
            await page.start()
            assert page.item["id"] == first.id
            for _ in range(3):
                await page.period(0)
            # Leaving the block cancels the session, as Ctrl-C does.

    asyncio.run(drive())
    run = run_of(tmp_path / "run", dataset)
    assert run.next_item() == second
    run.begin(second, "2026-01-02T03:04:05+00:00")  # and then the machine dies
    run.close()
    run = run_of(tmp_path / "run", dataset)
    assert run.next_item() == third
    rows = run.score()
    assert [row["outcome"] for row in rows] == ["failure", "failure"]
    assert "Given up by the driver" in rows[0]["detail"] and rows[0]["steps"] == 3
    assert "broken off" in rows[1]["detail"] and rows[1]["steps"] == 0
    assert all(row["policy_failed"] and row["score"] == 0 for row in rows)
    assert "partial: 1 of 3 items" in (tmp_path / "run" / "table.md").read_text()

    # The run may end where it stands; what was driven cannot be left out.
    assert run_of(tmp_path / "run", dataset, items=2).score() == rows
    assert "partial" not in (tmp_path / "run" / "table.md").read_text()
    with pytest.raises(ConfigError, match="2 items"):
        run_of(tmp_path / "run", dataset, items=1)
    with pytest.raises(ConfigError, match="another configuration"):
        run_of(tmp_path / "run", dataset, driver="ben")
    with pytest.raises(ConfigError, match="another configuration"):
        run_of(tmp_path / "run", dataset, assist=True)


def test_lane_keeping_assist_is_labelled_and_holds_the_lane(tmp_path: Path) -> None:
    run = run_of(tmp_path / "run", dataset_of(tmp_path / "data", "dec_rel_speed4"), assist=True)

    async def drive() -> None:
        async with at_the_wheel(run) as (page, _, _):
            await page.start()
            for _ in range(4):
                await page.period(LEFT)
            astray = abs(page.tick["askew"])
            for _ in range(25):
                await page.period(0)
            assert astray > 0.3 > 0.05 > abs(page.tick["askew"])

    asyncio.run(drive())
    (row,) = run.score()
    assert row["labels"] == ["human driver (ana)", "lane-keeping assist"]


def test_a_sample_that_cannot_be_set_up_is_told_apart_from_a_bad_drive(tmp_path: Path) -> None:
    whole = dataset_of(tmp_path / "data", "left_lc", "dec_rel_speed4")
    first, second = run_of(tmp_path / "draw", whole).items
    broken = json.loads((tmp_path / "data" / f"{first.task}.json").read_text())
    broken["samples"][0]["env"]["vehicles_density"] = 0
    (tmp_path / "data" / f"{first.task}.json").write_text(json.dumps(broken))
    run = run_of(tmp_path / "run", load_dataset(tmp_path / "data"))

    async def skip() -> str:
        async with at_the_wheel(run) as (page, _, _):
            await page.hear(lambda page: page.stage.get("stage") == "ready")
            return page.item["id"]

    assert asyncio.run(skip()) == second.id
    (row,) = run.rows()
    assert (row["item"], row["outcome"], row["infra_failed"], row["policy_failed"]) == (
        first.id,
        "not_driven",
        True,
        False,
    )
    assert "vehicles_density" in row["detail"]


def test_the_report_reads_the_run(tmp_path: Path) -> None:
    from chauffeur.bench.report.runs import load_run

    dataset = dataset_of(tmp_path / "data", "left_lc")
    run = run_of(tmp_path / "run", dataset)
    run.begin(run.items[0], "2026-01-02T03:04:05+00:00")
    run.score()
    run.close()
    loaded = load_run(tmp_path / "run")
    assert loaded.labels == ("human driver (ana)",) and loaded.planned == 1
