"""What a running benchmark says of itself, on a terminal and in a log."""

from __future__ import annotations

import io

from rich.console import Console

from chauffeur.bench.kernel.progress import Speedometer, Standing
from chauffeur.cli.lab.bench_progress import pace_words, shown, state_words

BUSY = Standing(
    planned=3136, asked=1300, done=1204, driven=1200, successes=900, collisions=6, failed=4, requests=1310, usd=0.432,
    in_flight=64, window=64, rate=41.24, eta_s=46.8,
)  # fmt: skip


def test_words_say_rate_time_flight_money_and_scores() -> None:
    assert pace_words(BUSY) == "41.2/s, 0:47 to go"
    assert state_words(BUSY) == [
        "64 of 64 in flight",
        "1,310 requests, 0.43 USD",
        "so far: completion 75.0 %, collision 0.50 %",
        "4 infra failed",
    ]


def test_words_leave_out_what_there_is_not() -> None:
    assert state_words(Standing(planned=10)) == []
    assert pace_words(Standing(planned=10, done=10, rate=2.0, eta_s=0.0)) == "2.0/s"
    assert pace_words(Standing(planned=10, rate=0.001, eta_s=9000.0)) == "0.0/s, 2:30:00 to go"
    held = state_words(Standing(planned=10, in_flight=1, window=3, held_s=12.4))
    assert held[0] == "1 of 3 in flight (the endpoint asks to wait 12 s)"


def test_a_log_gets_a_line_now_and_then_and_the_last() -> None:
    now = [0.0]
    out = io.StringIO()
    with shown(Console(file=out, width=200), lambda: now[0]) as watch:
        for done in range(101):
            now[0] += 0.25
            watch(Standing(planned=100, done=done, rate=4.0, eta_s=1.0))
        watch(Standing(planned=100, done=100, rate=4.0, eta_s=1.0))
    lines = out.getvalue().splitlines()
    assert [line.split()[0] for line in lines] == ["39/100", "79/100", "100/100"]


def test_a_terminal_gets_a_live_display() -> None:
    out = io.StringIO()
    console = Console(file=out, width=100, force_terminal=True)
    with shown(console, lambda: 0.0) as watch:
        watch(BUSY)
    text = out.getvalue()
    assert "1204/3136" in text and "0:47 to go" in text
    assert "completion 75.0 %, collision 0.50 %" in text, "whole on a hundred columns"


def test_the_rate_is_that_of_the_last_minute() -> None:
    meter = Speedometer()
    assert meter.rate(0.0, 0) == 0.0
    for second in range(1, 200):
        meter.rate(float(second), 10 * second)
    assert abs(meter.rate(200.0, 2000) - 10.0) < 1e-9
    for second in range(201, 300):
        meter.rate(float(second), 2000)
    assert meter.rate(300.0, 2000) == 0.0
