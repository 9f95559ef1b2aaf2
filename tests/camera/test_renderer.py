"""Pictures and their ground truth: against the pinhole, against geometry, and one renderer against the other."""

from __future__ import annotations

import math

import numpy as np
import pytest
from staged import agent, open_road, signals, town

from chauffeur.camera import (
    LOOKS,
    CameraImages,
    Conditions,
    Renderer,
    SemanticClass,
    front_rig,
    make_renderer,
    nuplan_rig,
    nuscenes_rig,
)
from chauffeur.camera import renderer as opengl_renderer
from chauffeur.concept import MissingExtraError
from chauffeur.concept.weather import WEATHERS
from chauffeur.geometry import Pose

SMALL = front_rig(224, 128)
DAY = Conditions()


def taken(renderer: Renderer, observation, rig=SMALL, conditions=DAY, **more) -> CameraImages:
    return renderer.render(observation, rig, conditions, 3, truth=True, **more)


def pinhole_box(camera, corners: np.ndarray) -> np.ndarray:
    pixels, depth = camera.project(corners)
    assert (depth > 0.0).all()
    return np.concatenate([pixels.min(axis=0), pixels.max(axis=0)])


def corners_of(ego: Pose, x: float, y: float, heading: float, size: tuple[float, float, float]) -> np.ndarray:
    body = Pose(x, y, heading)
    return np.array(
        [
            (*ego.sees(*body.place(a * size[0] / 2.0, b * size[1] / 2.0)), c * size[2])
            for a in (-1, 1)
            for b in (-1, 1)
            for c in (0, 1)
        ]
    )


@pytest.mark.parametrize("which", ["opengl", "painter"])
def test_boxes_are_those_of_the_pinhole(which, request):
    renderer = request.getfixturevalue(which)
    rig = front_rig(448, 256)
    truck = agent(5, 232.0, 0.5, 0.12, 25.0, "truck")
    seen = {s.instance.id: s for s in taken(renderer, open_road(truck), rig).truth[0].sightings}[5]
    expected = pinhole_box(rig.cameras[0], corners_of(Pose(200.0, -4.0, 0.0), 232.0, 0.5, 0.12, (10.0, 2.5, 3.7)))
    assert np.array(seen.full_box) == pytest.approx(expected, abs=0.05)
    assert np.array(seen.box) == pytest.approx(expected, abs=2.5)  # the truck fills its box but for its wheels' gaps
    assert seen.visibility == 1.0 and seen.truncation == 0.0
    assert seen.depth_m == pytest.approx(32.0 - 0.6, abs=0.3)


def test_left_is_left_in_every_camera(opengl):
    for rig in (nuscenes_rig(224, 128), nuplan_rig(224, 128)):
        turns = np.radians(range(5, 365, 30))
        ring = [agent(k, 200.0 + 14.0 * math.cos(a), -4.0 + 14.0 * math.sin(a)) for k, a in enumerate(turns, 1)]
        result = taken(opengl, open_road(*ring), rig)
        found: set[int | str] = set()
        for camera, truth in zip(rig.cameras, result.truth, strict=True):
            for seen in truth.sightings:
                i = seen.instance
                pixels, depth = camera.project(np.array([[i.x_m - rig.origin_ahead_m, i.y_m, i.z_m]]))
                if seen.truncation < 0.05 and seen.visibility > 0.9:
                    middle = (seen.box[0] + seen.box[2]) / 2.0
                    assert abs(middle - pixels[0, 0]) < 0.15 * (seen.box[2] - seen.box[0]) + 4.0
                    assert depth[0] == pytest.approx(seen.depth_m, abs=1e-3)
                found.add(i.id)
        assert found >= set(range(1, 13)) if rig.name == "nuscenes" else len(found) >= 10


def test_depth_is_that_of_the_ground_and_of_what_stands_on_it(opengl):
    rig = front_rig(448, 256)
    camera = rig.cameras[0]
    truth = taken(opengl, open_road(agent(1, 225.0, -4.0)), rig).truth[0]
    v, u = 230, 100
    (fx, fy), (cx, cy) = camera.focal_px, camera.centre_px
    ray = camera.rotation @ [(u + 0.5 - cx) / fx, (v + 0.5 - cy) / fy, 1.0]
    assert truth.classes[v, u] in (SemanticClass.ROAD, SemanticClass.LANE_MARKING)
    assert truth.depth_m[v, u] == pytest.approx(camera.position_m[2] / -ray[2], rel=0.006)
    on_car = truth.depth_m[truth.instances == 1]
    assert on_car.min() == pytest.approx(25.0 - 2.3 - 0.6, abs=0.15) and on_car.max() < 25.0 + 2.4
    assert np.isinf(truth.depth_m[truth.classes == SemanticClass.SKY]).all()


def test_what_hides_another_takes_its_pixels(opengl):
    alone = {s.instance.id: s for s in taken(opengl, open_road(agent(1, 240.0, -4.0))).truth[0].sightings}[1]
    behind = taken(opengl, open_road(agent(1, 240.0, -4.0), agent(2, 220.0, -4.0, kind="truck"))).truth[0]
    assert 1 not in {s.instance.id for s in behind.sightings}
    half = taken(opengl, open_road(agent(1, 240.0, -4.0), agent(2, 220.0, -5.2))).truth[0]
    partly = {s.instance.id: s for s in half.sightings}[1]
    assert 0.1 < partly.visibility < 0.95 and partly.pixels < alone.pixels
    assert [s.instance.distance_m for s in half.sightings] == sorted(s.instance.distance_m for s in half.sightings)


def test_cut_off_at_the_rim_is_said(opengl):
    beside = {s.instance.id: s for s in taken(opengl, open_road(agent(1, 203.5, 0.0))).truth[0].sightings}[1]
    assert beside.truncation > 0.3 and beside.box[0] == 0.0


def test_lanes_lie_in_the_image_where_the_pinhole_puts_them(opengl):
    rig = front_rig(448, 256)
    truth = taken(opengl, open_road(), rig).truth[0]
    assert truth.lanes[0].ego and truth.lanes[0].lane == "a1"
    for lane, middle in (("a0", 4.0), ("a1", 0.0), ("a2", -4.0)):
        seen = next(one for one in truth.lanes if one.lane == lane)
        depth = seen.depth_m[1]
        ahead = rig.cameras[0].project(np.array([[30.0, middle + 2.0, 0.0], [31.0, middle + 2.0, 0.0]]))
        at = [np.interp(ahead[1][0], depth, seen.left[:, k]) for k in (0, 1)]
        assert at == pytest.approx(ahead[0][0], abs=0.4)
        assert (seen.left[:, 0] < seen.right[:, 0]).all()
    # The paint is where the geometry says: left of the ego's lane, within two pixels of its edge.
    row = 200
    edge = float(np.interp(row + 0.5, truth.lanes[0].left[::-1, 1], truth.lanes[0].left[::-1, 0]))
    painted = np.nonzero(truth.classes[150:250] == SemanticClass.LANE_MARKING)
    assert len(painted[0]) > 20 and edge > 0.0


def test_the_two_renderers_agree_on_what_is_where(opengl, painter):
    for observation in (town(), open_road(agent(1, 225.0, -4.0, kind="bus"), agent(2, 215.0, 0.0, kind="motorcycle"))):
        a, b = taken(opengl, observation).truth[0], taken(painter, observation).truth[0]
        assert (a.instances == b.instances).mean() > 0.999
        assert (a.classes == b.classes).mean() > 0.985
        both = np.isfinite(a.depth_m) & np.isfinite(b.depth_m)
        assert np.quantile(np.abs(a.depth_m[both] / b.depth_m[both] - 1.0), 0.99) < 1e-3


@pytest.mark.parametrize("which", ["opengl", "painter"])
def test_same_input_same_bytes(which, request):
    renderer = request.getfixturevalue(which)
    conditions = Conditions(rain=0.6, night=0.8)
    once = renderer.render(town(tick=4), SMALL, conditions, 3)
    renderer.render(open_road(), front_rig(160, 96), Conditions(snow=1.0), 9)  # something else in between
    again = renderer.render(town(tick=4), SMALL, conditions, 3)
    assert once.images == again.images and once.truth == ()
    assert renderer.render(town(tick=5), SMALL, conditions, 3).images[0] != once.images[0]  # the rain falls on
    assert renderer.render(town(tick=4), SMALL, conditions, 4).images[0] != once.images[0]  # another place


def test_another_renderer_of_this_machine_gives_the_same_bytes(opengl):
    other = make_renderer("opengl")
    try:
        mine, its = (one.render(town(), SMALL, DAY, 3).images for one in (opengl, other))
        assert mine == its
        assert opengl.render(town(), SMALL, DAY, 3).images == mine  # two contexts do not disturb each other
    finally:
        other.close()


def test_weather_is_in_the_pixels(opengl):
    def of(conditions: Conditions) -> np.ndarray:
        return opengl.render(town(), SMALL, conditions, 3).images[0].pixels().astype(float)

    pictures = {name: of(Conditions.of(name, 0.7)) for name in WEATHERS}
    bright = {name: picture.mean() for name, picture in pictures.items()}
    assert bright["night"] < 0.65 * bright["sunny"] and bright["snow"] > bright["rain"]
    assert pictures["night"][:30].mean() < 0.5 * pictures["sunny"][:30].mean()
    blue = {name: (p[:40, :, 2] - p[:40, :, 0]).mean() for name, p in pictures.items()}
    assert blue["sunny"] > 1.5 * max(blue["rain"], blue["fog"], blue["snow"])
    ground = {name: p[100:].mean() for name, p in pictures.items()}
    assert ground["snow"] > 1.6 * ground["rain"]
    depth = taken(opengl, town()).truth[0].depth_m
    far = (depth > 55.0) & (depth < 220.0)
    contrast = {name: p[far].std() for name, p in pictures.items()}
    assert contrast["fog"] < 0.6 * contrast["sunny"]
    grades = [of(Conditions(fog=grade))[far].std() for grade in (0.2, 0.6, 1.0)]
    assert grades == sorted(grades, reverse=True)
    nights = [of(Conditions(night=grade)).mean() for grade in (0.0, 0.4, 1.0)]
    assert nights == sorted(nights, reverse=True)


def test_lights_show_their_state(opengl):
    def red_minus_green(state) -> float:
        result = taken(opengl, town(state), front_rig(448, 256), Conditions(night=1.0))
        seen = next(s for s in result.truth[0].sightings if s.instance.id == "s2")
        assert seen.instance.kind == state
        mask = result.truth[0].instances == seen.instance.number
        pixels = result.images[0].pixels()[mask].astype(float)
        return float((pixels[:, 0] - pixels[:, 1]).max() + (pixels[:, 0] - pixels[:, 1]).min())

    assert red_minus_green("red") > 60.0 > -60.0 > red_minus_green("green")
    assert {s.id for s in signals()} == {"s0", "s1", "s2", "s3"}


def test_braking_lights_up(opengl):
    def tail(acceleration: float) -> float:
        lead = agent(1, 215.0, -4.0, acceleration_mps2=acceleration)
        result = taken(opengl, open_road(lead), front_rig(448, 256))
        pixels = result.images[0].pixels()[result.truth[0].instances == 1].astype(float)
        return float((pixels[:, 0] - pixels[:, 1:].max(axis=1)).max())

    assert tail(-3.0) > tail(0.0) + 50.0


def test_looks_change_colours_and_lens_and_the_truth_bends_with_it(opengl):
    lead = agent(1, 215.0, 0.0)
    plain = taken(opengl, open_road(lead), front_rig(448, 256))
    for name in ("held_out_a", "held_out_b"):
        other = taken(opengl, open_road(lead), front_rig(448, 256), look=LOOKS[name])
        assert other.look == name
        apart = np.abs(other.images[0].pixels().astype(float) - plain.images[0].pixels()).mean()
        assert apart > 8.0
        seen, before = (r.truth[0].sightings[0] for r in (other, plain))
        mask = np.nonzero(other.truth[0].instances == 1)
        assert seen.box == (mask[1].min(), mask[0].min(), mask[1].max() + 1, mask[0].max() + 1)
        assert np.array(seen.full_box) == pytest.approx(np.array(seen.box), abs=5.0)
        assert seen.box != before.box


def test_where_there_is_no_egl_the_painter_is_chosen_and_said(monkeypatch, caplog):
    def broken(self) -> None:
        raise MissingExtraError("There is no EGL to render with.", hint="Run: apt install libegl1")

    monkeypatch.setattr(opengl_renderer.GlRenderer, "__init__", broken)
    made = make_renderer()
    assert "NumPy" in made.engine and "apt install libegl1" in caplog.text
    assert "NumPy" in made.render(open_road(), front_rig(64, 40), DAY).engine
    with pytest.raises(MissingExtraError):
        make_renderer("opengl")
