"""Cameras: projection, frames and conventions."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chauffeur.camera import RIGS, Camera, Rig, front_rig, nuplan_rig, nuscenes_rig, rig_of
from chauffeur.concept import ConfigError


def test_a_pinhole_projects_as_the_textbook_says():
    camera = Camera("c", 400, 200, (300.0, 310.0), (190.0, 105.0), (1.0, 0.5, 1.5))
    pixels, depth = camera.project(np.array([[11.0, 0.5, 1.5], [21.0, 2.5, 1.5], [11.0, 0.5, 0.5]]))
    assert depth == pytest.approx([10.0, 20.0, 10.0])
    assert pixels[0] == pytest.approx([190.0, 105.0])  # straight ahead: the principal point
    assert pixels[1] == pytest.approx([190.0 - 300.0 * 2.0 / 20.0, 105.0])  # 2 m to the left is left in the image
    assert pixels[2] == pytest.approx([190.0, 105.0 + 310.0 * 1.0 / 10.0])  # 1 m lower is lower


def test_looking_down_moves_the_horizon_up():
    camera = Camera.of_view("c", (400, 200), math.radians(80.0), (0.0, 0.0, 1.5), pitch_rad=math.radians(5.0))
    pixels, _ = camera.project(np.array([[1e6, 0.0, 1.5]]))
    assert pixels[0, 1] == pytest.approx(100.0 - camera.focal_px[1] * math.tan(math.radians(5.0)))


def test_quaternions_are_those_of_nuscenes():
    # A camera that looks ahead has (0.5, -0.5, 0.5, -0.5) there: camera x right, y down, z ahead.
    ahead = Camera.of_calibration("CAM_FRONT", (1600, 900), (1.7, 0, 1.5), (0.5, -0.5, 0.5, -0.5), np.eye(3).tolist())
    assert (ahead.yaw_rad, ahead.pitch_rad, ahead.roll_rad) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    assert ahead.rotation @ (0.0, 0.0, 1.0) == pytest.approx([1.0, 0.0, 0.0])
    rng = np.random.default_rng(4)
    for _ in range(20):
        yaw, pitch, roll = rng.uniform(-3.1, 3.1), rng.uniform(-1.4, 1.4), rng.uniform(-0.5, 0.5)
        camera = Camera("c", 160, 90, (80.0, 80.0), (80.0, 45.0), (0.0, 0.0, 1.0), yaw, pitch, roll)
        again = Camera.of_calibration("c", (160, 90), (0, 0, 1), camera.quaternion, camera.intrinsics.tolist())
        assert again.rotation == pytest.approx(camera.rotation, abs=1e-9)
        assert np.linalg.det(camera.rotation) == pytest.approx(1.0)


def test_rigs_have_the_channels_and_views_of_the_data_sets():
    six, eight = nuscenes_rig(), nuplan_rig()
    assert {c.name for c in six.cameras} == {
        "CAM_FRONT", "CAM_FRONT_LEFT", "CAM_FRONT_RIGHT", "CAM_BACK", "CAM_BACK_LEFT", "CAM_BACK_RIGHT",
    }  # fmt: skip
    assert {c.name for c in eight.cameras} == {f"CAM_{n}" for n in ("F0", "L0", "L1", "L2", "R0", "R1", "R2", "B0")}
    assert math.degrees(six["CAM_BACK"].view_rad) > 85.0 > math.degrees(six["CAM_FRONT"].view_rad) > 60.0
    for rig in (six, eight):
        # Whatever stands 20 m away is in sight of a camera, from every side, and left is left.
        for angle in np.radians(np.arange(0, 360, 3)):
            point = np.array([[20.0 * math.cos(angle) - rig.origin_ahead_m, 20.0 * math.sin(angle), 1.5]])
            seen = [c for c in rig.cameras if _inside(c, point)]
            if rig is six:
                assert seen, f"nothing sees {math.degrees(angle):.0f} degrees"
        assert all(c.position_m[1] > 0.0 for c in rig.cameras if "_L" in c.name)


def _inside(camera: Camera, point: np.ndarray) -> bool:
    pixels, depth = camera.project(point)
    return bool(depth[0] > 0.0 and 0.0 <= pixels[0, 0] < camera.width)


def test_another_size_keeps_the_view_and_square_pixels():
    for name in RIGS:
        small, large = rig_of(name, 224, 224), rig_of(name, 960, 540)
        for a, b in zip(small.cameras, large.cameras, strict=True):
            assert a.view_rad == pytest.approx(b.view_rad)
            assert a.focal_px[0] == pytest.approx(a.focal_px[1])
            assert (a.width, a.height) == (224, 224)


def test_what_is_no_camera_is_said():
    with pytest.raises(ConfigError, match="pictures of 0x100"):
        Camera("c", 0, 100, (50.0, 50.0), (0.0, 0.0), (0.0, 0.0, 1.0))
    with pytest.raises(ConfigError, match="focal length"):
        Camera("c", 100, 100, (0.0, 50.0), (0.0, 0.0), (0.0, 0.0, 1.0))
    with pytest.raises(ConfigError, match="no camera rig 'kitti'"):
        rig_of("kitti")
    with pytest.raises(ConfigError, match="no camera 'CAM_TOP'"):
        nuscenes_rig()["CAM_TOP"]
    front = front_rig().cameras[0]
    with pytest.raises(ConfigError, match="own name"):
        Rig("twice", (front, front))
