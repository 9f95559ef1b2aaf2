"""The renderer for machines without EGL: the same scene by a z-buffer in NumPy; simpler shading, about a second a
picture at 448x256."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np

from chauffeur.camera.ground import Marking, Paving
from chauffeur.camera.light import Light
from chauffeur.camera.look import CameraLook
from chauffeur.camera.precipitation import falling
from chauffeur.camera.projection import NEAR_M, Viewpoint
from chauffeur.camera.renderer import Masks, Renderer, Shot
from chauffeur.camera.scene import CameraScene
from chauffeur.camera.solids import (
    CLASS,
    GLOW,
    INSTANCE,
    MATERIAL,
    PITCH,
    RED,
    SHIFT,
    SX,
    SZ,
    TAPER_X,
    YAW,
    Material,
    SemanticClass,
    Shape,
    Solids,
    X,
    Z,
    mesh_of,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from chauffeur.camera.weather import Conditions

    FloatArray = NDArray[np.float64]
    IntArray = NDArray[np.int64]

_DEFAULT_LOOK: Final = CameraLook()
_TERRAIN_M: Final = 700.0
_LOWER_M: Final = {Paving.TERRAIN: 0.02, Paving.SIDEWALK: 0.014, Paving.KERB: 0.010, Paving.JUNCTION: 0.006}
_HIGHER_M: Final = {Paving.ZEBRA: 0.004, Paving.STOP_LINE: 0.004, Paving.YIELD_LINE: 0.004}
_CLASSES: Final = {
    Paving.TERRAIN: SemanticClass.TERRAIN,
    Paving.SIDEWALK: SemanticClass.SIDEWALK,
    Paving.KERB: SemanticClass.SIDEWALK,
    Paving.ZEBRA: SemanticClass.CROSSWALK,
    Paving.STOP_LINE: SemanticClass.LANE_MARKING,
    Paving.YIELD_LINE: SemanticClass.LANE_MARKING,
}


class _Triangles:
    """Triangles in a scene with what shading needs of each: places (n, 3, 3), and one value a triangle of the rest."""

    def __init__(self, scene: CameraScene, solids: Solids, ground: bool) -> None:
        places: list[FloatArray] = []
        colours: list[FloatArray] = []
        normals: list[FloatArray] = []
        marks: list[FloatArray] = []  # instance, class, material, glow
        lanes: list[FloatArray] = []  # along and across (3, 2), half width, markings, kind
        if ground:
            rows = np.concatenate([_terrain(scene), scene.view.triangles, scene.lines]).astype(float)
            kinds = rows[:, 0, 7].astype(int)
            z = np.array([_HIGHER_M.get(Paving(k), 0.0) - _LOWER_M.get(Paving(k), 0.0) for k in range(10)])[kinds]
            z = np.where((kinds == Paving.LOT) & (rows[:, 0, 4] > 100.0), -0.006, z)
            places.append(np.concatenate([rows[:, :, :2], np.repeat(z[:, None, None], 3, axis=1)], axis=2))
            colours.append(np.zeros((len(rows), 3)))
            normals.append(np.tile((0.0, 0.0, 1.0), (len(rows), 1)))
            label = np.array([_CLASSES.get(Paving(k), SemanticClass.ROAD) for k in range(10)])[kinds]
            marks.append(np.stack([np.zeros(len(rows)), label, np.full(len(rows), -1.0), np.zeros(len(rows))], axis=1))
            lanes.append(np.concatenate([rows[:, :, 2:4].reshape(-1, 6), rows[:, 0, 4:8]], axis=1))
        for shape in Shape:
            chosen = solids.rows[solids.shapes == shape].astype(float)
            if not len(chosen):
                continue
            vertices, triangles = mesh_of(shape)
            world, turned = _posed(chosen, vertices)
            corners = world[:, triangles].reshape(-1, 3, 3)
            places.append(corners)
            count = len(triangles)
            colours.append(np.repeat(chosen[:, RED : RED + 3], count, axis=0))
            normal = turned[:, triangles].mean(axis=2).reshape(-1, 3)
            normals.append(normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9))
            marks.append(np.repeat(chosen[:, [INSTANCE, CLASS, MATERIAL, GLOW]], count, axis=0))
            lanes.append(np.zeros((len(corners), 10)))
        none = np.zeros((0, 3))
        self.places = np.concatenate(places) if places else np.zeros((0, 3, 3))
        self.colours = np.concatenate(colours) if colours else none
        self.normals = np.concatenate(normals) if normals else none
        self.marks = np.concatenate(marks) if marks else np.zeros((0, 4))
        self.lanes = np.concatenate(lanes) if lanes else np.zeros((0, 10))


def _terrain(scene: CameraScene) -> NDArray[np.float32]:
    corners = np.zeros((2, 3, 8), np.float32)
    half = _TERRAIN_M
    corners[0, :, :2] = (-half, -half), (half, -half), (half, half)
    corners[1, :, :2] = (-half, -half), (half, half), (-half, half)
    corners[:, :, :2] += (scene.ego.x_m, scene.ego.y_m)
    return corners


def _posed(rows: FloatArray, vertices: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Vertices and normals (n, k, 3) of a mesh at the poses of solids; as the vertex shader has it."""
    place = np.repeat(vertices[None, :, :3], len(rows), axis=0)
    top = place[:, :, 2] + 0.5
    size = rows[:, None, SX : SZ + 1]
    taper = rows[:, None, TAPER_X : TAPER_X + 2]
    place[:, :, :2] *= 1.0 + (taper - 1.0) * top[:, :, None]
    place[:, :, 0] += rows[:, None, SHIFT] * top
    place = place * size
    normal = vertices[None, :, 3:] / size
    sides = (np.abs(vertices[None, :, 3:5]) * (1.0 - taper) * 0.5).sum(axis=2) / size[:, :, 2]
    normal[:, :, 2] += sides * (1.0 - np.abs(vertices[None, :, 5]))
    found: list[FloatArray] = []
    cp, sp = np.cos(rows[:, None, PITCH]), np.sin(rows[:, None, PITCH])
    cy, sy = np.cos(rows[:, None, YAW]), np.sin(rows[:, None, YAW])
    for one in (place, normal):
        x = cp * one[:, :, 0] + sp * one[:, :, 2]
        z = cp * one[:, :, 2] - sp * one[:, :, 0]
        found.append(np.stack([cy * x - sy * one[:, :, 1], sy * x + cy * one[:, :, 1], z], axis=2))
    return found[0] + rows[:, None, X : Z + 1], found[1]


def _before(places: FloatArray) -> tuple[FloatArray, IntArray]:
    """Triangles (m, 3, 3) of the camera frame cut at the plane before it, and the row each came from."""
    depth = places[:, :, 2]
    whole = (depth >= NEAR_M).all(axis=1)
    rows: list[int] = np.nonzero(whole)[0].tolist()
    parts: list[FloatArray] = [places[whole]]
    for row in np.nonzero(~whole & (depth > NEAR_M).any(axis=1))[0].tolist():
        ring: list[FloatArray] = []
        for i in range(3):
            a, b = places[row, i], places[row, (i + 1) % 3]
            if a[2] >= NEAR_M:
                ring.append(a)
            if (a[2] - NEAR_M) * (b[2] - NEAR_M) < 0.0:
                ring.append(a + (NEAR_M - a[2]) / (b[2] - a[2]) * (b - a))
        for i in range(1, len(ring) - 1):
            parts.append(np.stack([ring[0], ring[i], ring[i + 1]])[None])
            rows.append(row)
    return np.concatenate(parts), np.array(rows, np.int64)


def _rasterised(places: FloatArray, point: Viewpoint) -> tuple[IntArray, FloatArray]:
    """Of triangles (n, 3, 3) of the scene: which of them each pixel shows, -1 for none, and its depth, (H, W)."""
    camera = point.camera
    seen, origin = _before((places - point.position_m) @ point.rotation)
    shown = np.full((camera.height, camera.width), -1)
    depth = np.full((camera.height, camera.width), np.inf)
    if not len(seen):
        return shown, depth
    pixels = seen[:, :, :2] / seen[:, :, 2:] * np.array(camera.focal_px) + np.array(camera.centre_px)
    inverse = 1.0 / seen[:, :, 2]
    low = np.clip(np.ceil(pixels.min(axis=1) - 0.5), 0, None).astype(np.int64)
    high = np.minimum(np.floor(pixels.max(axis=1) - 0.5), (camera.width - 1, camera.height - 1)).astype(np.int64)
    a, b, c = pixels[:, 0], pixels[:, 1], pixels[:, 2]
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    for i in np.nonzero((high >= low).all(axis=1) & (np.abs(area) > 1e-9))[0].tolist():
        (x0, y0), (x1, y1) = low[i].tolist(), high[i].tolist()
        u = np.arange(x0, x1 + 1) + 0.5
        v = (np.arange(y0, y1 + 1) + 0.5)[:, None]
        (ax, ay), (bx, by), (cx, cy) = a[i].tolist(), b[i].tolist(), c[i].tolist()
        wb = ((u - ax) * (cy - ay) - (v - ay) * (cx - ax)) / area[i]
        wc = ((bx - ax) * (v - ay) - (by - ay) * (u - ax)) / area[i]
        wa = 1.0 - wb - wc
        inside = (wa >= 0.0) & (wb >= 0.0) & (wc >= 0.0)
        if not inside.any():
            continue
        z = 1.0 / np.where(inside, wa * inverse[i, 0] + wb * inverse[i, 1] + wc * inverse[i, 2], 1.0)
        block = depth[y0 : y1 + 1, x0 : x1 + 1]
        nearer = inside & (z < block)
        block[nearer] = z[nearer]
        shown[y0 : y1 + 1, x0 : x1 + 1][nearer] = origin[i]
    return shown, depth


class PainterRenderer(Renderer):
    """Renders in NumPy."""

    @property
    def engine(self) -> str:
        """Name of the renderer, for people."""
        return "NumPy (no EGL: simpler pictures)"

    def close(self) -> None:
        """Nothing to give back."""

    def _draw(self, shot: Shot) -> tuple[NDArray[np.uint8], Callable[[], Masks]]:
        scene, point = shot.scene, shot.point
        triangles = _Triangles(scene, shot.solids, ground=True)
        shown, depth = _rasterised(triangles.places, point)
        picture, markings = _shaded(scene, point, triangles, shown, depth, shot.light, shot.conditions)
        _fall(picture, falling(point.camera, shot.conditions, shot.light, scene.seed, scene.tick, shot.index))

        def masks() -> Masks:
            hit, of = shown >= 0, np.maximum(shown, 0)
            instances = np.where(hit, triangles.marks[of, 0], 0).astype(np.uint16)
            classes = np.where(hit, triangles.marks[of, 1], 0).astype(np.uint8)
            classes[markings] = SemanticClass.LANE_MARKING
            return Masks(instances, classes, depth.astype(np.float32), partial(_alone, scene, shot.solids, point))

        return _graded(picture, shot.look), masks


def _alone(scene: CameraScene, solids: Solids, point: Viewpoint, number: int) -> int:
    only = _Triangles(scene, solids.chosen(solids.rows[:, INSTANCE] == number), ground=False)
    return int((_rasterised(only.places, point)[0] >= 0).sum())


def _shaded(
    scene: CameraScene,
    point: Viewpoint,
    triangles: _Triangles,
    shown: IntArray,
    depth: FloatArray,
    light: Light,
    conditions: Conditions,
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """The picture (H, W, 3), 0 to 1, and which pixels show a lane marking."""
    camera = point.camera
    u, v = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    ray = np.stack(
        [
            (u - camera.centre_px[0]) / camera.focal_px[0],
            (v - camera.centre_px[1]) / camera.focal_px[1],
            np.ones_like(u),
        ],
        axis=2,
    )
    world = ray @ point.rotation.T
    up = world[..., 2] / np.linalg.norm(world, axis=2)
    share = np.exp(-3.2 * np.maximum(up, 0.0))[..., None]
    sky = np.array(light.horizon) * share + np.array(light.zenith) * (1.0 - share)
    mist = (light.mist * np.exp(-2.2 * np.maximum(up, 0.0)))[..., None]
    sky = sky * (1.0 - mist) + np.array(light.air) * mist
    hit = shown >= 0
    markings = np.zeros(hit.shape, bool)
    picture = sky
    if not hit.any():
        return picture, markings
    of = shown[hit]
    place = point.position_m + world[hit] * depth[hit][:, None]
    normal, colour = triangles.normals[of], triangles.colours[of].copy()
    material, glow = triangles.marks[of, 2], triangles.marks[of, 3]
    ground = material < -0.5
    on, lines = _paved(triangles, of[ground], place[ground], light, conditions)
    colour[ground] = on
    markings[hit] = _scattered(ground, lines)
    colour[material == Material.SIGN] = _faces(colour[material == Material.SIGN])
    if conditions.snow:
        white = np.where(ground, 0.0, np.clip((normal[:, 2] - 0.35) * 2.5, 0.0, 1.0) * min(1.0, conditions.snow * 1.5))
        colour += (0.95 - colour) * white[:, None]
    facing = np.maximum(normal @ np.array(light.sun), 0.0)[:, None]
    half = (0.5 + 0.5 * normal[:, 2])[:, None]
    lit = np.array(light.ground_light) * (1.0 - half) + np.array(light.sky_light) * half
    lit = lit + np.array(light.sun_light) * facing
    if conditions.lamps:
        front = scene.ego.ahead(scene.ego_size_m[0] / 2.0)
        away = place[:, :2] - (front.x_m, front.y_m)
        far = np.linalg.norm(away, axis=1) + 0.01
        ahead = away @ (math.cos(scene.ego.heading_rad), math.sin(scene.ego.heading_rad)) / far
        beam = np.clip((ahead - 0.80) / 0.18, 0.0, 1.0) * np.exp(-far / 26.0)
        lit = lit + (1.25 * conditions.night * beam)[:, None]
    shaded = colour * lit
    window = (material == Material.FACADE) & _panes(place, normal)
    dark = conditions.night > 0.3
    shaded[window] = (0.85, 0.68, 0.42) if dark else shaded[window] * 0.4 + np.array(light.sky_light) * 0.15
    lamp = material == Material.LAMP
    own = np.where(glow < 0.0, -glow * conditions.night, glow)[:, None] * np.clip(
        triangles.colours[of] * 1.5 + 0.1, 0, 1
    )
    shaded = np.where(lamp[:, None], np.maximum(shaded, own), shaded)
    through = np.exp(-conditions.extinction * np.linalg.norm(place - point.position_m, axis=1))[:, None]
    shaded = np.array(light.air) * (1.0 - through) + shaded * through
    picture[hit] = np.where(lamp[:, None], np.maximum(shaded, own * through**0.5), shaded)
    return picture, markings


def _faces(colour: FloatArray) -> FloatArray:
    """Colours of signs, from what says which sign they are: a stop sign is red, the others white."""
    return np.where(colour[:, :1] * 8.0 < 1.5, (0.72, 0.05, 0.06), (0.95, 0.94, 0.93))


def _panes(place: FloatArray, normal: FloatArray) -> NDArray[np.bool_]:
    along = place[:, 1] * normal[:, 0] - place[:, 0] * normal[:, 1]
    across, height = along / 2.7 % 1.0, place[:, 2] / 3.3 % 1.0
    return (np.abs(normal[:, 2]) < 0.5) & (np.abs(across - 0.5) < 0.25) & (np.abs(height - 0.55) < 0.25)


def _scattered(where: NDArray[np.bool_], values: NDArray[np.bool_]) -> NDArray[np.bool_]:
    found = np.zeros(len(where), bool)
    found[where] = values
    return found


def _paved(
    triangles: _Triangles, of: IntArray, place: FloatArray, light: Light, conditions: Conditions
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Colours (n, 3) of places on the ground, and which of them lie on a marking."""
    corners, lane = triangles.places[of], triangles.lanes[of]
    a, b, c = corners[:, 0, :2], corners[:, 1, :2], corners[:, 2, :2]
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    area = np.where(np.abs(area) < 1e-9, 1e-9, area)
    d = place[:, :2] - a
    wb = (d[:, 0] * (c[:, 1] - a[:, 1]) - d[:, 1] * (c[:, 0] - a[:, 0])) / area
    wc = ((b[:, 0] - a[:, 0]) * d[:, 1] - (b[:, 1] - a[:, 1]) * d[:, 0]) / area
    wa = 1.0 - wb - wc
    along = wa * lane[:, 0] + wb * lane[:, 2] + wc * lane[:, 4]
    across = wa * lane[:, 1] + wb * lane[:, 3] + wc * lane[:, 5]
    half, kind = lane[:, 6], lane[:, 9].astype(int)
    wet = 1.0 - 0.42 * conditions.wet
    colour = np.tile(np.array((0.275, 0.277, 0.285)) * wet, (len(of), 1))
    colour[kind == Paving.TERRAIN] = np.array(light.terrain) * (1.0 - 0.25 * conditions.wet)
    colour[np.isin(kind, (Paving.SIDEWALK, Paving.KERB))] = np.array((0.57, 0.56, 0.54)) * wet
    colour[kind == Paving.BICYCLE] = np.array((0.46, 0.20, 0.16)) * wet
    white = np.zeros(len(of), bool)
    yellow = np.zeros(len(of), bool)
    striped = np.isin(kind, (Paving.LANE, Paving.BICYCLE)) | ((kind == Paving.LOT) & (half < 100.0))
    for code, edge in ((lane[:, 7], half - across), (lane[:, 8], half + across)):
        white |= striped & (code == Marking.DASHED) & (edge < 0.075) & (along % 9.0 < 3.0)
        white |= striped & (code == Marking.SOLID) & (edge < 0.075)
        yellow |= striped & (code == Marking.DOUBLE_YELLOW) & (np.abs(edge - 0.11) < 0.06)
        yellow |= striped & (code == Marking.YELLOW_EDGE) & (np.abs(edge - 0.16) < 0.08)
        white |= striped & (code == Marking.EDGE) & (np.abs(edge - 0.16) < 0.08)
    bars = np.isin(kind, (Paving.ZEBRA, Paving.YIELD_LINE)) & (along % 1.0 < 0.5) | (kind == Paving.STOP_LINE)
    colour[white | bars] = 0.86
    colour[yellow] = (0.86, 0.65, 0.12)
    if conditions.snow:
        tracks = np.isin(kind, (Paving.LANE, Paving.LOT)) & (np.abs(np.abs(across) - 0.85) < 0.35)
        cover = min(1.0, conditions.snow * 1.5) * np.where(tracks, 0.4, 0.95)
        colour += (np.array((0.86, 0.88, 0.92)) - colour) * cover[:, None]
    return colour, white | yellow


def _fall(picture: FloatArray, drops: NDArray[np.float32]) -> None:
    """Rain and snow over a picture, in place."""
    height, width = picture.shape[:2]
    for x, y, w, h, *look in drops.tolist():
        cx, cy = (x + 1.0) * width / 2.0, (y + 1.0) * height / 2.0
        rx, ry = max(w * width / 2.0, 0.6), max(h * height / 2.0, 0.6)
        x0, x1 = max(0, math.floor(cx - rx)), min(width, math.ceil(cx + rx) + 1)
        y0, y1 = max(0, math.floor(cy - ry)), min(height, math.ceil(cy + ry) + 1)
        if x0 >= x1 or y0 >= y1:
            continue
        dx = (np.arange(x0, x1) + 0.5 - cx) / rx
        dy = ((np.arange(y0, y1) + 0.5 - cy) / ry)[:, None]
        soft = (look[3] * np.maximum(0.0, 1.0 - dx * dx - dy * dy))[..., None]
        block = picture[y0:y1, x0:x1]
        block += (np.array(look[:3]) - block) * soft


def _graded(picture: FloatArray, look: CameraLook) -> NDArray[np.uint8]:
    height, width = picture.shape[:2]
    u = (np.arange(width) + 0.5) / width - 0.5
    v = ((np.arange(height) + 0.5) / height - 0.5)[:, None]
    bright = look.exposure * (1.0 - look.vignette * 1.6 * (u * u + v * v))
    c = (picture * np.array(look.tint) * bright[..., None] - 0.5) * look.contrast + 0.5
    grey = (c @ np.array((0.30, 0.59, 0.11)))[..., None]
    return (np.clip(grey + (c - grey) * look.saturation, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)
