"""nuScenes tables as others write them: other rates by their time stamps, and rows that are not as they should be."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from openloop_data import write_nuscenes

from chauffeur.bench.openloop.nuscenes import NuScenesTables, PlanningSample
from chauffeur.concept import DataError

SPEED_MPS = 5.0


def a_set(root: Path, times_s: list[float], scale: float = 1e6) -> NuScenesTables:
    """A straight drive at 5 m/s with samples at these times."""
    keys = [f"k{i}" for i in range(len(times_s))]
    stamps = [round(1.5e15 + time * scale) if scale == 1e6 else time * scale for time in times_s]
    tables: dict[str, list[dict[str, Any]]] = {
        "sensor": [{"token": "s", "channel": "CAM_FRONT"}],
        "calibrated_sensor": [{"token": "c", "sensor_token": "s"}],
        "scene": [{"token": "sc", "name": "scene-1", "first_sample_token": keys[0]}],
        "sample": [
            {"token": key, "timestamp": stamp, "next": after}
            for key, stamp, after in zip(keys, stamps, [*keys[1:], ""], strict=True)
        ],
        "sample_data": [
            {"token": f"d{key}", "sample_token": key, "ego_pose_token": f"p{key}", "calibrated_sensor_token": "c",
             "is_key_frame": True, "filename": f"samples/{key}.jpg"}
            for key in keys
        ],
        "ego_pose": [
            {"token": f"p{key}", "rotation": [1, 0, 0, 0], "translation": [SPEED_MPS * time, 0, 0]}
            for key, time in zip(keys, times_s, strict=True)
        ],
    }  # fmt: skip
    folder = root / "v1.0-mini"
    folder.mkdir(parents=True)
    for name, rows in tables.items():
        (folder / f"{name}.json").write_text(json.dumps(rows))
    return NuScenesTables(root, "v1.0-mini")


def right(samples: list[PlanningSample]) -> None:
    """Speeds and waypoints are those of the drive, half seconds apart."""
    assert samples
    for one in samples:
        assert np.allclose(one.speeds_mps, SPEED_MPS, rtol=0.13)
        known = one.future[np.isfinite(one.future[:, 0])]
        assert np.allclose(known[:, 0], 2.5 * np.arange(1, len(known) + 1), rtol=0.13)


@pytest.mark.parametrize("rate_hz", [2.0, 4.0, 10.0, 12.0, 20.0])
def test_other_rates_are_thinned_by_time_stamps(tmp_path: Path, rate_hz: float) -> None:
    samples = a_set(tmp_path, [i / rate_hz for i in range(int(8 * rate_hz) + 1)]).samples()
    right(samples)
    assert len(samples) == 12, "17 half seconds; four before the first, one after the last"


@pytest.mark.parametrize("rate_hz", [0.5, 1.0, 1.4, 3.0, 5.0])
def test_rates_that_do_not_fit_are_refused(tmp_path: Path, rate_hz: float) -> None:
    tables = a_set(tmp_path, [i / rate_hz for i in range(40)])
    with pytest.raises(DataError, match=r"0\.5 s is needed"):
        tables.samples()


@pytest.mark.parametrize("scale", [1.0, 1e3, 1e9])
def test_other_units_of_time_are_refused(tmp_path: Path, scale: float) -> None:
    tables = a_set(tmp_path, [i / 2.0 for i in range(20)], scale)
    with pytest.raises(DataError, match="microseconds"):
        tables.samples()


def test_key_frames_that_jitter_are_at_two_hertz(tmp_path: Path) -> None:
    jitter = np.random.default_rng(3).uniform(-0.05, 0.05, 17)
    samples = a_set(tmp_path, (np.arange(17) / 2.0 + jitter).tolist()).samples()
    assert len(samples) == 12


def test_what_lies_beyond_a_gap_is_another_drive(tmp_path: Path) -> None:
    times = [i / 2.0 for i in range(9)] + [20.0 + i / 2.0 for i in range(9)]
    samples = a_set(tmp_path, times).samples()
    right(samples)
    assert len(samples) == 8 and not any(one.whole for one in samples)


def test_time_that_runs_backwards_is_named(tmp_path: Path) -> None:
    tables = a_set(tmp_path, [0.0, 0.5, 1.0, 0.9, 2.0, 2.5])
    with pytest.raises(DataError, match=r"sample\.json, row 'k3': 'timestamp'"):
        tables.samples()


def test_samples_that_lead_in_a_circle_are_named(tmp_path: Path) -> None:
    a_set(tmp_path, [i / 2.0 for i in range(8)])
    path = tmp_path / "v1.0-mini" / "sample.json"
    rows = json.loads(path.read_text())
    rows[-1]["next"] = "k2"
    path.write_text(json.dumps(rows))
    with pytest.raises(DataError, match="circle"):
        NuScenesTables(tmp_path, "v1.0-mini").samples()


FIELDS = {
    "sensor": ("channel",),
    "calibrated_sensor": ("sensor_token",),
    "scene": ("name", "first_sample_token"),
    "sample": ("timestamp", "next"),
    "sample_data": ("sample_token", "ego_pose_token", "calibrated_sensor_token", "is_key_frame", "filename"),
    "ego_pose": ("translation", "rotation"),
}
ODD: list[Any] = [
    "gone",
    None,
    [],
    {},
    [1, 2],
    [1, 2, 3, "4"],
    ["a"],
    {"x": 1},
    True,
    10**30,
    float("nan"),
    [0, 0, 0, 0],
]


@pytest.mark.parametrize("odd", ODD, ids=lambda one: str(one)[:12])
@pytest.mark.parametrize(("table", "field"), [(table, one) for table, many in FIELDS.items() for one in many])
def test_a_row_that_is_not_right_is_named_by_table_token_and_field(
    tmp_path: Path, table: str, field: str, odd: Any
) -> None:
    folder = write_nuscenes(tmp_path) / "v1.0-mini"
    path = folder / f"{table}.json"
    rows = json.loads(path.read_text())
    if odd == "gone":
        del rows[0][field]
    else:
        rows[0][field] = odd
    path.write_text(json.dumps(rows))
    if (field, odd) == ("is_key_frame", True):
        return
    with pytest.raises(DataError) as caught:
        NuScenesTables(tmp_path, "v1.0-mini").samples()
    said = str(caught.value)
    assert f"{table}.json" in said and repr(field) in said and repr(rows[0]["token"]) in said


@pytest.mark.parametrize("file", ["../../etc/passwd", "/etc/passwd", "samples/../../x.jpg"])
def test_pictures_lie_in_the_folder_of_the_set(tmp_path: Path, file: str) -> None:
    path = write_nuscenes(tmp_path) / "v1.0-mini" / "sample_data.json"
    rows = json.loads(path.read_text())
    rows[0]["filename"] = file
    path.write_text(json.dumps(rows))
    with pytest.raises(DataError, match="filename"):
        NuScenesTables(tmp_path, "v1.0-mini").samples()


def test_frames_from_the_field(tmp_path: Path, case_folder: Callable[[str], Path]) -> None:
    for case in ("nuscenes-other-rate", "nuscenes-raw-error"):
        shutil.copytree(case_folder(case), tmp_path / case / "v1.0-mini")
    assert NuScenesTables(tmp_path / "nuscenes-other-rate", "v1.0-mini").samples() == [], "1.3 s hold no sample"
    with pytest.raises(DataError, match=r"sensor.json, row 's1': 'channel' is missing"):
        NuScenesTables(tmp_path / "nuscenes-raw-error", "v1.0-mini").samples()
