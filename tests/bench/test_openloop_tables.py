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


def right(samples: list[PlanningSample], off: float = 0.13) -> None:
    """Speeds and waypoints are those of the drive, half seconds apart."""
    assert samples
    for one in samples:
        assert np.allclose(one.speeds_mps, SPEED_MPS, rtol=off)
        known = one.future[np.isfinite(one.future[:, 0])]
        assert np.allclose(known[:, 0], 2.5 * np.arange(1, len(known) + 1), rtol=off)


JITTER_S = np.random.default_rng(3).uniform(-0.05, 0.05, 17)
"""As of nuScenes' key frames, which are the LIDAR sweeps closest to every half second."""


@pytest.mark.parametrize(
    ("times_s", "off"),
    [
        *(([i / rate_hz for i in range(int(8 * rate_hz) + 1)], 0.13) for rate_hz in (2.0, 4.0, 10.0, 12.0, 20.0)),
        ((np.arange(17) / 2.0 + JITTER_S).tolist(), 0.25),
    ],
)
def test_samples_closest_to_every_half_second_are_taken(tmp_path: Path, times_s: list[float], off: float) -> None:
    samples = a_set(tmp_path, times_s).samples()
    assert len(samples) == 12, "17 half seconds; four before the first, one after the last"
    right(samples, off)


@pytest.mark.parametrize(
    ("times_s", "scale", "said"),
    [
        *(([i / rate_hz for i in range(40)], 1e6, r"0\.5 s is needed") for rate_hz in (0.5, 1.0, 1.4, 3.0, 5.0)),
        *(([i / 2.0 for i in range(20)], scale, "microseconds") for scale in (1.0, 1e3, 1e9)),
        ([0.0, 0.5, 1.0, 0.9, 2.0, 2.5], 1e6, r"sample\.json, row 'k3': 'timestamp'"),
    ],
)
def test_times_that_do_not_fit_are_refused(tmp_path: Path, times_s: list[float], scale: float, said: str) -> None:
    tables = a_set(tmp_path, times_s, scale)
    with pytest.raises(DataError, match=said):
        tables.samples()


def test_what_lies_beyond_a_gap_is_another_drive(tmp_path: Path) -> None:
    times = [i / 2.0 for i in range(9)] + [20.0 + i / 2.0 for i in range(9)]
    samples = a_set(tmp_path, times).samples()
    right(samples)
    assert len(samples) == 8 and not any(one.whole for one in samples)


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


@pytest.mark.parametrize(
    ("table", "row", "field", "value", "said"),
    [
        *(
            ("sample_data", 0, "filename", file, "filename")
            for file in ("../../etc/passwd", "/etc/passwd", "samples/../../x.jpg")
        ),
        ("sample", -1, "next", "scene-0003-2", "circle"),
    ],
)
def test_files_outside_and_circles_are_refused(
    tmp_path: Path, table: str, row: int, field: str, value: str, said: str
) -> None:
    path = write_nuscenes(tmp_path) / "v1.0-mini" / f"{table}.json"
    rows = json.loads(path.read_text())
    rows[row][field] = value
    path.write_text(json.dumps(rows))
    with pytest.raises(DataError, match=said):
        NuScenesTables(tmp_path, "v1.0-mini").samples()


def test_frames_from_the_field(tmp_path: Path, case_folder: Callable[[str], Path]) -> None:
    for case in ("nuscenes-other-rate", "nuscenes-raw-error"):
        shutil.copytree(case_folder(case), tmp_path / case / "v1.0-mini")
    assert NuScenesTables(tmp_path / "nuscenes-other-rate", "v1.0-mini").samples() == [], "1.3 s hold no sample"
    with pytest.raises(DataError, match=r"sensor.json, row 's1': 'channel' is missing"):
        NuScenesTables(tmp_path / "nuscenes-raw-error", "v1.0-mini").samples()
