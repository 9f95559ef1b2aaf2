# ruff: noqa: NPY002 - compiled code knows only the legacy generator
"""Certifies the box of gains that an action matrix may come from, by driving thousands of gain sets.

Every gain set drives the three manoeuvres of the paper's Sec. VI-C on CommonRoad's three plants, in a weather, with
errors at the start and with wandering actuators, all drawn for it. A set is bad where one of the nine drives breaks a
bound of BOUNDS. From a wide box, the side that loses the least is cut until no bad set of the pilot is left in it; the
box that remains is certified with sets drawn anew, and shrinks again where one of those is bad.

    python benchmarks/gain_box.py pilot --sets 3000 --out pilot.jsonl      # wide box
    python benchmarks/gain_box.py shrink pilot.jsonl --out box.json
    python benchmarks/gain_box.py certify box.json --sets 10000 --out certificate.json

The loop is compiled (numba) from the product's own functions: `pid_step`, the condensed programs of `control.mpc`, the
plants of `worlds.track`. Where no bound of the quadratic program binds, its solution is the unconstrained one; else it
is solved by ADMM, with the tolerance that `compare` measures against the product (OSQP, the executor, the world):

    python benchmarks/gain_box.py compare box.json --sets 30
"""

from __future__ import annotations

import argparse
import json
import math
import multiprocessing
import sys
import time
from pathlib import Path
from typing import Any

import numba
import numpy as np

from chauffeur.concept import ActionMatrix, Limits
from chauffeur.concept.weather import WEATHERS
from chauffeur.control import mpc, pid
from chauffeur.executors import executor_for
from chauffeur.executors.reference import STEP_M, ReferencePath
from chauffeur.executors.tracking import bicycle_for
from chauffeur.worlds.track import FRICTION, MANOEUVRES, TrackWorld, track_scenario
from chauffeur.worlds.track import world as track
from chauffeur.worlds.track.dynamics import BRAKES_MPS2, PLANTS, TRACTION_MPS2, advance, initial_state
from chauffeur.worlds.track.manoeuvres import manoeuvre

NAMES = ("kp", "ki", "kd", "wl", "wh", "ws")
WIDE = {
    "kp": (0.05, 2.0),
    "ki": (0.0, 0.15),
    "kd": (0.0, 0.5),
    "wl": (0.5, 100.0),
    "wh": (0.5, 100.0),
    "ws": (10.0, 1000.0),
}
LOGARITHMIC = {"kp", "wl", "wh", "ws"}
BOUNDS = {
    "offset_m": 0.5,  # leaves 0.44 m to the line in a lane of 3.5 m
    "lateral_mps2": 4.0,
    "weave_m": 0.15,  # largest offset in the last two seconds: a drive that does not calm down
    "lateral_jerk_mps3": 5.0,  # mean of its size
    "overshoot_mps": 1.0,  # the excess over a limit that the default limits tolerate
    "lag_mps": 2.5,  # below the target speed at the end (16 s after a start from a stand)
    "jerk_mps3": 4.5,  # largest, commanded
}
METRICS = tuple(BOUNDS)
SECONDS = {"acceleration": 16.0, "lane_change": 6.0, "left_turn": 9.0}
RK_STEP_S = 0.002
DT_S = track.DT_S
HORIZON = mpc.HORIZON
BINS = 36

_pid_step = numba.njit(pid.pid_step)
_CAR = bicycle_for(track.CHASSIS)
_LIMITS = mpc.SteeringLimits(angle_rad=track.FULL_LOCK_RAD)
_PID_LIMITS = pid.PidLimits(high_mps2=track.CHASSIS.acceleration_mps2)


def _basis() -> tuple[Any, ...]:
    """Condensed programs of unit weights at every speed: they are linear in the weights."""
    parts = []
    for unit in (mpc.MpcWeights(1.0, 0.0, 0.0), mpc.MpcWeights(0.0, 1.0, 0.0), mpc.MpcWeights(0.0, 0.0, 1.0)):
        made = [mpc.condense(_CAR, unit, i * mpc.SPEED_STEP_MPS, DT_S) for i in range(BINS)]
        parts.append(
            (
                np.array([one.quadratic for one in made]),
                np.array([one.state for one in made]),
                np.array([one.curvature for one in made]),
            )
        )
    p, g, k = (np.ascontiguousarray(np.stack([part[i] for part in parts])) for i in range(3))
    return p, g, k


@numba.njit(cache=False)
def _solve(inverse, factor, rho, q, most, turn, before, start):
    """The quadratic program: unconstrained where that keeps the bounds, ADMM from there on elsewhere."""
    n = len(q)
    u = -(inverse @ q)
    fits = True
    last = before
    for k in range(n):
        if abs(u[k]) > most or abs(u[k] - last) > turn:
            fits = False
            break
        last = u[k]
    if fits:
        return u
    x = start.copy()
    z1, z2 = np.zeros(n), np.zeros(n)
    y1, y2 = np.zeros(n), np.zeros(n)
    for k in range(n):
        z1[k] = min(max(x[k], -most), most)
        d = x[k] - (x[k - 1] if k else before)
        z2[k] = min(max(d, -turn), turn)
    rhs = np.zeros(n)
    for _ in range(400):
        for k in range(n):
            b1 = rho * z1[k] - y1[k]
            b2 = rho * (z2[k] + (before if k == 0 else 0.0)) - y2[k]
            rhs[k] = -q[k] + b1 + b2
            if k + 1 < n:
                rhs[k] -= rho * z2[k + 1] - y2[k + 1]
        x = factor @ rhs
        worst = 0.0
        moved = 0.0
        for k in range(n):
            w = x[k] + y1[k] / rho
            new = min(max(w, -most), most)
            moved = max(moved, abs(new - z1[k]))
            z1[k] = new
            y1[k] += rho * (x[k] - new)
            worst = max(worst, abs(x[k] - new))
            d = x[k] - (x[k - 1] if k else before)
            w = d + y2[k] / rho
            new = min(max(w, -turn), turn)
            moved = max(moved, abs(new - z2[k]))
            z2[k] = new
            y2[k] += rho * (d - new)
            worst = max(worst, abs(d - new))
        if worst < 1e-6 and moved < 1e-6:
            break
    return x


def _loop(step_plant):
    """One drive, compiled for one plant."""

    @numba.njit(cache=False)
    def drive(
        state, gains, weights, basis_p, basis_g, basis_k, seconds, target, friction, seed, car, pid_limits,
        rx, ry, rh, rk, out,
    ):  # fmt: skip
        n = HORIZON
        np.random.seed(seed)
        wl, wh, ws = weights
        slip_a, slip_b, grip, lock, rate, wander_rad, wander_mps2 = car
        ready = np.zeros(BINS, dtype=np.bool_)
        inverse, factor = np.zeros((BINS, n, n)), np.zeros((BINS, n, n))
        by_state, by_bend = np.zeros((BINS, n, 5)), np.zeros((BINS, n, n))
        rho = np.zeros(BINS)
        d = np.eye(n)
        for k in range(1, n):
            d[k, k - 1] = -1.0
        ata = np.eye(n) + d.T @ d
        memory = pid.PidState(0.0, 0.0, 0.0, 0.0, 0.0)
        acceleration = angle = 0.0
        off_rad, off_mps2 = np.random.normal() * wander_rad, np.random.normal() * wander_mps2
        kept = math.exp(-DT_S / 1.0)
        spread = math.sqrt(1.0 - kept * kept)
        turn = rate * DT_S
        steps = round(seconds / DT_S)
        inner = round(DT_S / RK_STEP_S)
        near = 0
        plan = np.zeros(n)
        last_ay = last_a = 0.0
        jerk_sum = 0.0
        kappa = np.zeros(n)
        x = np.zeros(5)
        for i in range(steps):
            px, py, heading = state[0], state[1], state[4]
            v, r = max(state[3], 0.0), state[5]
            best = 1e18
            low, high = max(0, near - 4), min(len(rx), near + 20)
            for j in range(low, high):
                away = (rx[j] - px) ** 2 + (ry[j] - py) ** 2
                if away < best:
                    best, near = away, j
            c, s = math.cos(rh[near]), math.sin(rh[near])
            along, left = c * (px - rx[near]) + s * (py - ry[near]), c * (py - ry[near]) - s * (px - rx[near])
            bend = rk[near]
            offset = left - 0.5 * bend * along * along
            turned = heading - rh[near] - bend * along
            turned = (turned + math.pi) % (2.0 * math.pi) - math.pi
            station = near * STEP_M + along
            wanted, memory = _pid_step(gains, pid_limits, memory, target - v, DT_S)
            bin_ = min(round(v / 0.5), BINS - 1)
            if not ready[bin_]:
                p = wl * basis_p[0, bin_] + wh * basis_p[1, bin_] + ws * basis_p[2, bin_]
                by_state[bin_] = wl * basis_g[0, bin_] + wh * basis_g[1, bin_]
                by_bend[bin_] = wl * basis_k[0, bin_] + wh * basis_k[1, bin_]
                inverse[bin_] = np.linalg.inv(p)
                rho[bin_] = 0.3 * np.trace(p) / n
                factor[bin_] = np.linalg.inv(p + rho[bin_] * ata)
                ready[bin_] = True
            slip = -(slip_a * v * v - slip_b) * r / v if v > 1.0 else 0.0
            x[0], x[1], x[2], x[3], x[4] = offset, v * (turned + slip), turned, r - bend * v, state[2]
            way = station
            speed = v
            for k in range(n):
                at = way / STEP_M
                j = int(at)
                kappa[k] = 0.0
                if 0 <= j < len(rk) - 1:
                    kappa[k] = rk[j] + (at - j) * (rk[j + 1] - rk[j])
                speed = max(v + wanted * min(k * DT_S, 1.0), 0.0)
                way += speed * DT_S
            q = by_state[bin_] @ x + by_bend[bin_] @ kappa
            q[0] -= 2.0 * ws * angle
            most = min(lock, grip[0] / max(v, 0.1) ** 2 * (grip[1] + grip[2] * v * v))
            most = max(most, abs(angle) - turn)
            plan[:-1] = plan[1:]
            plan = _solve(inverse[bin_], factor[bin_], rho[bin_], q, most, turn, angle, plan)
            angle = min(max(plan[0], angle - turn, -lock), angle + turn, lock)
            off_rad = kept * off_rad + np.random.normal() * wander_rad * spread
            off_mps2 = kept * off_mps2 + np.random.normal() * wander_mps2 * spread
            given = min(max(min(wanted, 3.0), -BRAKES_MPS2 * friction), TRACTION_MPS2 * friction)
            stands = state[3] < 0.05 and given <= 0.0
            acceleration = step_plant(
                state, acceleration, friction, angle + off_rad, 0.0 if stands else given + off_mps2, inner
            )
            if not np.isfinite(state.sum()):
                out[:] = 1e3
                return
            ay = state[3] * state[5]
            out[0] = max(out[0], abs(offset))
            out[1] = max(out[1], abs(ay))
            if i * DT_S > seconds - 2.0:
                out[2] = max(out[2], abs(offset))
            if i:
                jerk_sum += abs(ay - last_ay) / DT_S
                out[6] = max(out[6], abs(wanted - last_a) / DT_S)
            last_ay, last_a = ay, wanted
            out[4] = max(out[4], v - target)
        out[3] = jerk_sum / max(steps - 1, 1)
        out[5] = target - state[3]

    return drive


class Sweep:
    """All nine drives of a gain set; made once a process."""

    def __init__(self, plants=PLANTS) -> None:
        self.basis = _basis()
        self.plants = plants
        self.drives = {plant: _loop(advance(plant, RK_STEP_S)) for plant in plants}
        gradient = _CAR.mass_kg / _CAR.wheelbase_m * (_CAR.rear_m / _CAR.front_npr - _CAR.front_m / _CAR.rear_npr)
        self.car = (
            _CAR.front_m * _CAR.mass_kg / (_CAR.rear_npr * _CAR.wheelbase_m),
            _CAR.rear_m,
            (_LIMITS.lateral_mps2, _CAR.wheelbase_m, gradient),
            _LIMITS.angle_rad,
            _LIMITS.rate_radps,
            track._WANDER_RAD,
            track._WANDER_MPS2,
        )
        self.references = {name: ReferencePath(manoeuvre(name).path, manoeuvre(name).speed_mps) for name in MANOEUVRES}

    def run(self, values, seed, weather, errors, noise=1.0):
        """Metrics (plants, manoeuvres, METRICS) of a gain set."""
        out = np.zeros((len(self.plants), len(MANOEUVRES), len(METRICS)))
        gains, weights = pid.PidGains(*values[:3]), tuple(values[3:])
        car = (*self.car[:5], self.car[5] * noise, self.car[6] * noise)
        for a, plant in enumerate(self.plants):
            for b, name in enumerate(MANOEUVRES):
                plan, ref = manoeuvre(name), self.references[name]
                start = plan.path.at(0.0)
                state = initial_state(
                    plant,
                    start.x_m,
                    start.y_m + errors[0],
                    start.heading_rad + errors[1],
                    max(0.0, plan.start_mps + (errors[2] if plan.start_mps else 0.0)),
                )
                self.drives[plant](
                    state, gains, weights, *self.basis, SECONDS[name], plan.speed_mps, FRICTION[weather], seed, car,
                    _PID_LIMITS, ref.x, ref.y, ref.heading, ref.curvature, out[a, b],
                )  # fmt: skip
        return out


def draw(rng, box):
    """A gain set."""
    values = []
    for name in NAMES:
        low, high = box[name]
        if name in LOGARITHMIC:
            values.append(math.exp(rng.uniform(math.log(low), math.log(high))))
        else:
            values.append(rng.uniform(low, high))
    return values


_sweep: Sweep | None = None


def _one(task):
    assert _sweep is not None
    seed, box = task
    rng = np.random.default_rng(seed)
    values = draw(rng, box)
    weather = WEATHERS[int(rng.integers(len(WEATHERS)))]
    errors = [float(rng.uniform(-0.2, 0.2)), float(rng.uniform(-0.01, 0.01)), float(rng.uniform(-0.5, 0.5))]
    out = _sweep.run(values, seed % 2**31, weather, errors)
    return {"seed": seed, "gains": values, "weather": weather, "errors": errors, "out": out.round(4).tolist()}


def sample(box, sets, first, jobs, path):
    """Drive gain sets, and write each as it is done; what a file has already is not driven again."""
    done = set()
    if path.exists():
        done = {json.loads(line)["seed"] for line in path.read_text().splitlines()}
    tasks = [(first + i, box) for i in range(sets) if first + i not in done]
    global _sweep  # noqa: PLW0603 - compiled once, before the workers are forked
    _sweep = _sweep or Sweep()
    _one((0, box))
    began = time.monotonic()
    with multiprocessing.get_context("fork").Pool(jobs) as pool, path.open("a") as file:
        for count, row in enumerate(pool.imap_unordered(_one, tasks, chunksize=8), 1):
            file.write(json.dumps(row) + "\n")
            if count % 200 == 0:
                file.flush()
                rate = count / (time.monotonic() - began)
                print(f"{count}/{len(tasks)} sets, {rate:.1f} a second", file=sys.stderr, flush=True)
    return read(path)


def read(path):
    """Gains (n, 6) and worst metrics over the drives (n, plants, manoeuvres, METRICS)."""
    rows = [json.loads(line) for line in path.read_text().splitlines()]
    rows.sort(key=lambda row: row["seed"])
    return np.array([row["gains"] for row in rows]), np.array([row["out"] for row in rows]), rows


def broken(out):
    """Which sets break a bound, (n,)."""
    return (out.max(axis=(1, 2)) > np.array([BOUNDS[name] for name in METRICS])).any(axis=1)


def shrunk(gains, bad, box):
    """The box cut, one side at a time, where the fewest good sets are lost, until no bad set is inside."""
    scaled = gains.copy()
    low, high = np.array([box[name][0] for name in NAMES]), np.array([box[name][1] for name in NAMES])
    while True:
        inside = ((scaled >= low) & (scaled <= high)).all(axis=1)
        if not (inside & bad).any():
            return {name: (float(low[i]), float(high[i])) for i, name in enumerate(NAMES)}
        best = None
        for i in range(len(NAMES)):
            values = np.sort(scaled[inside & bad, i])
            for side in (0, 1):
                # Cut off the outermost tenth of the bad sets, at least one.
                count = max(1, len(values) // 10)
                at = values[count - 1] if side == 0 else values[-count]
                gone = inside & ((scaled[:, i] <= at) if side == 0 else (scaled[:, i] >= at))
                score = (gone & ~bad).sum() / max((gone & bad).sum(), 1)
                if best is None or score < best[0]:
                    best = (score, i, side, at)
        _, i, side, at = best
        if side == 0:
            low[i] = at * 1.02 if at > 0 else at + 1e-3
        else:
            high[i] = at * 0.98


def product_drive(values, name, plant, weather, seed):
    """Worst lateral error and lateral acceleration of the product itself: executor, OSQP, world; no lead vehicle."""
    from dataclasses import replace

    policy = ActionMatrix(tuple(values[:3]), tuple(values[3:]))
    scenario = track_scenario(name, weather, plant)
    world = TrackWorld()
    shot = world.reset(replace(scenario, config={**scenario.config, "noise": 0.0}), seed)
    executor = executor_for(policy, world)
    executor.start(policy, replace(shot, others=()), Limits())
    worst = lateral = 0.0
    for _ in range(round(SECONDS[name] / DT_S)):
        world.step(executor.step(replace(shot, others=())))
        shot = world.observe()
        worst = max(worst, abs(executor.tracker.offset_m))
        lateral = max(lateral, abs(shot.ego.speed_mps * shot.ego.yaw_rate_radps))
        if shot.ego.crashed:
            break
    return worst, lateral


def compare(box, sets):
    """Largest difference between the compiled loop and the product, noise off."""
    sweep, rng = Sweep(), np.random.default_rng(7)
    gaps = []
    for _ in range(sets):
        values = draw(rng, box)
        weather = WEATHERS[int(rng.integers(len(WEATHERS)))]
        out = sweep.run(values, 1, weather, (0.0, 0.0, 0.0), noise=0.0)
        for a, plant in enumerate(PLANTS):
            for b, name in enumerate(MANOEUVRES):
                if name == "acceleration":
                    continue
                worst, lateral = product_drive(values, name, plant, weather, 1)
                gaps.append((abs(worst - out[a, b, 0]), abs(lateral - out[a, b, 1])))
    gaps = np.array(gaps)
    return {"sets": sets, "offset_m": float(gaps[:, 0].max()), "lateral_mps2": float(gaps[:, 1].max())}


def main() -> None:
    """Run a stage."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("stage", choices=("pilot", "shrink", "certify", "compare"))
    parser.add_argument("file", type=Path, nargs="?")
    parser.add_argument("--sets", type=int, default=10_000)
    parser.add_argument("--first", type=int, default=1_000_000)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("gain_box.json"))
    args = parser.parse_args()
    if args.stage == "pilot":
        sample(WIDE, args.sets, args.first, args.jobs, args.out)
    elif args.stage == "shrink":
        gains, out, _ = read(args.file)
        args.out.write_text(json.dumps(shrunk(gains, broken(out), WIDE), indent=2))
    elif args.stage == "compare":
        print(json.dumps(compare(json.loads(args.file.read_text()), args.sets)))
    else:
        found = json.loads(args.file.read_text())  # a box, or a certificate with its box
        box = found.get("box", found)
        lines = args.out.with_suffix(".jsonl")
        gains, out, rows = sample(box, args.sets, args.first, args.jobs, lines)
        bad = broken(out)
        args.out.write_text(json.dumps(certificate(box, gains, out, rows, bad), indent=2))


def certificate(box, gains, out, rows, bad):
    """What was driven and the worst of it."""
    worst = out.max(axis=(0, 2))
    return {
        "box": box,
        "sets": len(gains),
        "violations": int(bad.sum()),
        "drives": int(out.shape[0] * out.shape[1] * out.shape[2]),
        "bounds": BOUNDS,
        "worst": {plant: dict(zip(METRICS, worst[a].round(4).tolist(), strict=True)) for a, plant in enumerate(PLANTS)},
        "weathers": {w: sum(row["weather"] == w for row in rows) for w in WEATHERS},
        "rk_step_s": RK_STEP_S,
        "seeds": [rows[0]["seed"], rows[-1]["seed"]],
        "simulated": True,
    }


if __name__ == "__main__":
    main()
