"""Real drives with real faults: a spread of the suite, in one drive that ends with the death of control."""

from __future__ import annotations

import pytest

from chauffeur.bench.chaos.model import ModelServer
from chauffeur.bench.chaos.runner import ChaosConfig, play_drive
from chauffeur.bench.chaos.table import failures
from chauffeur.bench.chaos.witness import Witness

KINDS = ("model-creeps-beyond", "wishes-garbage", "orders-garbage", "worker-killed", "policy-killed", "control-killed")


@pytest.mark.slow
@pytest.mark.server
def test_nothing_unsafe_and_nothing_lost_whatever_breaks() -> None:
    config = ChaosConfig(kinds=KINDS, first=4)
    rows = []
    with ModelServer() as server, Witness() as witness:
        play_drive([config.draw(number) for number in range(len(KINDS))], config, server, witness, rows.append)
    assert failures(rows) == []
    struck = {row["kind"] for row in rows}
    assert {"wishes-garbage", "orders-garbage", "control-killed"} <= struck
    last = next(row for row in rows if row["kind"] == "control-killed")
    assert last["notes"]["orphans"] == [] and last["notes"]["memory_left"] is False
    assert last["notes"]["told_after_s"] < 5.0


@pytest.mark.slow
@pytest.mark.server
def test_a_dead_supervisor_leaves_every_wish_in_the_audit_log_and_a_car_that_stands() -> None:
    config = ChaosConfig(kinds=("supervisor-killed",), first=2)
    rows = []
    with ModelServer() as server, Witness() as witness:
        play_drive([config.draw(0)], config, server, witness, rows.append)
    assert len(rows) == 1 and failures(rows) == []
    assert rows[0]["notes"]["orphans"] == []
