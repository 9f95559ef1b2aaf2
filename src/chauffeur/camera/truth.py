"""Ground truth of a picture: boxes with visibility, and lanes, from masks and geometry."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Final

import numpy as np

from chauffeur.camera.pictures import ImageLane, ImageTruth, PixelBox, Sighting
from chauffeur.geometry import Lane, RoadGraph

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from chauffeur.camera.lens import Lens
    from chauffeur.camera.projection import Viewpoint
    from chauffeur.camera.scene import CameraScene, Instance
    from chauffeur.concept.scene import Observation

    FloatArray = NDArray[np.float64]

LANES_M: Final = 80.0
"""How far lanes are followed."""
_NEAR_M: Final = 0.3
_LANE_STEP_M: Final = 2.0


def truth_of(
    scene: CameraScene,
    point: Viewpoint,
    observation: Observation,
    instances: NDArray[np.uint16],
    classes: NDArray[np.uint8],
    depth_m: NDArray[np.float32],
    alone: Callable[[int], int],
    lens: Lens,
) -> ImageTruth:
    """Ground truth from the masks of one picture.

    Args:
        scene: What was drawn.
        point: The camera in it.
        observation: What the scene was made of.
        instances: Numbers (H, W), before the lens.
        classes: Classes (H, W), before the lens.
        depth_m: Depths (H, W), before the lens.
        alone: Pixels that an instance covers when nothing else is there.
        lens: The lens.
    """
    counts = np.bincount(instances.ravel(), minlength=len(scene.instances) + 1)
    bent = lens.bend(instances)
    sightings: list[Sighting] = []
    for instance in scene.instances:
        shown = int(counts[instance.number])
        if not shown:
            continue
        box = _tight(bent == instance.number)
        if box is None:
            continue
        outline, depth = outline_of(instance, point, scene, lens)
        full, truncation = _cut(outline, point.camera.width, point.camera.height)
        hidden = max(alone(instance.number), shown)
        sightings.append(Sighting(instance, box, full or box, shown, shown / hidden, truncation, depth))
    sightings.sort(key=lambda one: one.instance.distance_m)
    lanes = _lanes(scene, point, observation.road, lens)
    return ImageTruth(point.camera.name, bent, lens.bend(classes), lens.bend(depth_m), tuple(sightings), lanes)


def outline_of(instance: Instance, point: Viewpoint, scene: CameraScene, lens: Lens) -> tuple[FloatArray, float]:
    """Convex outline (k, 2), px, of an instance's box before the camera, and the depth of its middle, m."""
    corners = instance.corners_m
    world = np.array([(*scene.ego.place(x, y), z) for x, y, z in corners.tolist()])
    middle = np.array([*scene.ego.place(instance.x_m, instance.y_m), instance.z_m])
    seen = (world - point.position_m) @ point.rotation
    depth = float(((middle - point.position_m) @ point.rotation)[2])
    kept = [tuple(p) for p in seen if p[2] >= _NEAR_M]
    # Edges that pass the plane before the camera end there.
    for i in range(8):
        for bit in (1, 2, 4):
            j = i ^ bit
            if i < j and (seen[i, 2] - _NEAR_M) * (seen[j, 2] - _NEAR_M) < 0.0:
                share = (_NEAR_M - seen[i, 2]) / (seen[j, 2] - seen[i, 2])
                kept.append(tuple(seen[i] + share * (seen[j] - seen[i])))
    if not kept:
        return np.zeros((0, 2)), depth
    points = np.array(kept)
    pixels = points[:, :2] / points[:, 2:] * np.array(point.camera.focal_px) + np.array(point.camera.centre_px)
    return lens.points(pixels), depth


def _tight(mask: NDArray[np.bool_]) -> PixelBox | None:
    rows, columns = np.nonzero(mask.any(axis=1))[0], np.nonzero(mask.any(axis=0))[0]
    if not len(rows):
        return None
    return float(columns[0]), float(rows[0]), float(columns[-1] + 1), float(rows[-1] + 1)


def _cut(outline: FloatArray, width: int, height: int) -> tuple[PixelBox | None, float]:
    """The box of an outline cut to the image, and the share of its box that lies outside."""
    if not len(outline):
        return None, 1.0
    low, high = outline.min(axis=0), outline.max(axis=0)
    inside_low, inside_high = np.clip(low, 0.0, (width, height)), np.clip(high, 0.0, (width, height))
    whole = float(np.prod(np.maximum(high - low, 1e-6)))
    inside = float(np.prod(np.maximum(inside_high - inside_low, 0.0)))
    box = (float(inside_low[0]), float(inside_low[1]), float(inside_high[0]), float(inside_high[1]))
    return box, min(1.0, max(0.0, 1.0 - inside / whole))


def _lanes(scene: CameraScene, point: Viewpoint, road: RoadGraph, lens: Lens) -> tuple[ImageLane, ...]:
    ox, oy = scene.view.origin_m
    x, y = scene.ego.x_m + ox, scene.ego.y_m + oy
    own = road.locate(x, y, scene.ego.heading_rad)
    field = scene.view.place.field
    near = np.unique(field.lanes[np.hypot(field.places[:, 0] - x, field.places[:, 1] - y) < LANES_M])
    found: list[ImageLane] = []
    for row in near.tolist():
        lane = road.lanes[row]
        seen = _lane(lane, scene, point, (x, y), lens, own is not None and own.lane == lane.id)
        if seen is not None:
            found.append(seen)
    found.sort(key=lambda lane: not lane.ego)
    return tuple(found)


def _lane(
    lane: Lane, scene: CameraScene, point: Viewpoint, here: tuple[float, float], lens: Lens, ego: bool
) -> ImageLane | None:
    middle = lane.centre.nearest(*here)
    low, high = max(0.0, middle - LANES_M), min(lane.length_m, middle + LANES_M)
    if high - low < _LANE_STEP_M:
        return None
    stations = np.arange(low, high, _LANE_STEP_M)
    x, y, heading = lane.centre.poses(stations)
    rows: list[FloatArray] = []
    for offset in (0.0, lane.width_m / 2.0, -lane.width_m / 2.0):
        places = np.stack(
            [
                x - np.sin(heading) * offset - scene.view.origin_m[0],
                y + np.cos(heading) * offset - scene.view.origin_m[1],
                np.zeros(len(x)),
            ],
            axis=1,
        )
        rows.append((places - point.position_m) @ point.rotation)
    depth = np.stack([row[:, 2] for row in rows])
    ahead = (depth > 1.0).all(axis=0)
    if ahead.sum() < 2:
        return None
    camera = point.camera
    focal, centre = np.array(camera.focal_px), np.array(camera.centre_px)
    lines = [lens.points(row[ahead, :2] / row[ahead, 2:] * focal + centre) for row in rows]
    inside = [((line >= 0.0) & (line < (camera.width, camera.height))).all(axis=1).any() for line in lines]
    if not any(inside):
        return None
    return ImageLane(lane.id, ego, lines[0], lines[1], lines[2], depth[:, ahead])
