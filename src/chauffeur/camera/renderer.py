"""The renderer: OpenGL 3.3 without a display (EGL; Mesa's llvmpipe on a CPU), a few instanced draw calls a picture."""

from __future__ import annotations

import math
import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from chauffeur.camera.ground import VERTEX, Paving
from chauffeur.camera.lens import Lens
from chauffeur.camera.light import Light, light_of
from chauffeur.camera.look import CameraLook
from chauffeur.camera.pictures import CameraImages, ImageTruth
from chauffeur.camera.precipitation import FALL, falling
from chauffeur.camera.projection import Viewpoint, viewpoints
from chauffeur.camera.rig import Camera, Rig
from chauffeur.camera.scene import CameraScene, PlaceView, SceneBuilder
from chauffeur.camera.shaders import shader
from chauffeur.camera.solids import INSTANCE, MATERIAL, PITCH, SX, YAW, Material, Shape, Solids, X, Z, mesh_of, together
from chauffeur.camera.truth import truth_of
from chauffeur.camera.weather import Conditions
from chauffeur.concept import CameraImage, MissingExtraError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from chauffeur.concept.scene import Observation

    FloatArray = NDArray[np.float64]
    RowArray = NDArray[np.float32]

_SHADOW_PX: Final = 768
_SHADOW_REACH_M: Final = 60.0
_SHADOWLESS_M: Final = 0.2
_DEFAULT_LOOK: Final = CameraLook()
_FAINT: Final = 0.06
"""Shadows weaker than this are not drawn."""


@dataclass(frozen=True, slots=True)
class Shot:
    """One picture to take.

    Attributes:
        scene: What there is.
        point: The camera in it.
        index: Of the camera in its rig.
        solids: Those that the camera may see.
        light, conditions, look: How it is lit, seen through and graded.
    """

    scene: CameraScene
    point: Viewpoint
    index: int
    solids: Solids
    light: Light
    conditions: Conditions
    look: CameraLook


@dataclass(frozen=True, slots=True)
class Masks:
    """Masks of a picture before the lens, each (H, W).

    Attributes:
        instances, classes, depth_m: See `ImageTruth`.
        alone: Pixels that an instance covers when nothing else is there.
    """

    instances: NDArray[np.uint16]
    classes: NDArray[np.uint8]
    depth_m: NDArray[np.float32]
    alone: Callable[[int], int]


class Renderer(ABC):
    """Takes pictures of observations. Heirs draw a shot."""

    def __init__(self) -> None:
        self._builder = SceneBuilder()

    @property
    @abstractmethod
    def engine(self) -> str:
        """Name of the renderer, for people."""

    def _drawing(self, scene: CameraScene, light: Light) -> AbstractContextManager[object]:
        """Context in which all pictures of an instant are taken."""
        del scene, light
        return nullcontext()

    @abstractmethod
    def _draw(self, shot: Shot) -> tuple[NDArray[np.uint8], Callable[[], Masks]]:
        """The picture (H, W, 3) before the lens, and what makes its masks."""

    def render(
        self,
        observation: Observation,
        rig: Rig,
        conditions: Conditions,
        seed: int = 0,
        *,
        look: CameraLook = _DEFAULT_LOOK,
        truth: bool = False,
    ) -> CameraImages:
        """Pictures of all cameras; same input, same bytes on one machine.

        Args:
            observation: What is there; needs its `road`.
            rig: The cameras.
            conditions: Weather and light.
            seed: Of the place: what stands along the road, and where the sun is.
            look: Palette, exposure and lens.
            truth: Whether to give ground truth with each picture.

        Raises:
            ScenarioError: The observation has no road graph.
        """
        scene = self._builder.scene(observation, conditions, look, seed)
        light = light_of(conditions, look, seed, scene.view.place.surroundings)
        everything = together([scene.view.solids, scene.movable])
        images: list[CameraImage] = []
        truths: list[ImageTruth] = []
        with self._drawing(scene, light):
            for index, point in enumerate(viewpoints(rig, scene.ego)):
                camera, solids = point.camera, everything.chosen(point.seen(everything))
                pixels, masks = self._draw(Shot(scene, point, index, solids, light, conditions, look))
                lens = Lens.of(camera, look)
                pixels = lens.noisy(lens.bend(pixels), seed, scene.tick, index)
                images.append(CameraImage(camera.name, scene.time_s, pixels))
                if truth:
                    one = masks()
                    truths.append(
                        truth_of(scene, point, observation, one.instances, one.classes, one.depth_m, one.alone, lens)
                    )
        return CameraImages(
            tuple(images), tuple(truths), rig.cameras, conditions, seed, look.name, f"rendered by {self.engine}"
        )

    @abstractmethod
    def close(self) -> None:
        """Give its memory back."""


_FRAGMENTS: Final = {
    "plain": shader("PLAIN_FRAGMENT"),
    "facade": shader("FACADE_FRAGMENT"),
    "foliage": shader("FOLIAGE_FRAGMENT"),
    "sign": shader("SIGN_FRAGMENT"),
}
_GROUPS: Final = tuple(_FRAGMENTS)
_MATERIAL_GROUPS: Final = np.array(
    [{Material.FACADE: 1, Material.FOLIAGE: 2, Material.SIGN: 3}.get(material, 0) for material in sorted(Material)]
)
_BUCKETS: Final = (
    (Shape.BOX, "facade"),
    (Shape.BOX, "plain"),
    (Shape.CYLINDER, "plain"),
    (Shape.WHEEL, "plain"),
    (Shape.BALL, "plain"),
    (Shape.CYLINDER, "foliage"),
    (Shape.BALL, "foliage"),
    (Shape.BOX, "sign"),
)
_INSTANCE: Final = 20
_INSTANCE_LAYOUT: Final = (
    ("4f", "i_turn"),
    ("3f", "i_at"),
    ("3f", "i_size"),
    ("3f", "i_colour"),
    ("4f", "i_form"),
    ("3f", "i_mark"),
)
_GROUND_ORDER: Final = ("paint", "lane", "pavement", "terrain")
_GROUND_LAYERS: Final = {
    "pavement": (Paving.JUNCTION, Paving.SIDEWALK, Paving.KERB),
    "lane": (Paving.LANE, Paving.BICYCLE, Paving.LOT),
    "paint": (Paving.ZEBRA, Paving.STOP_LINE, Paving.YIELD_LINE),
}


class GlRenderer(Renderer):
    """Renders by OpenGL. One a thread: a context belongs to the thread that made it."""

    def __init__(self) -> None:
        """Raises MissingExtraError: moderngl is not installed, or there is no EGL."""
        super().__init__()
        try:
            import moderngl
        except ImportError as error:
            raise MissingExtraError("Rendered pictures need moderngl.", extra="camera") from error
        # One thread a renderer: processes render side by side, and llvmpipe's own threads get in their way.
        os.environ.setdefault("LP_NUM_THREADS", "1")
        try:
            standalone: Any = moderngl.create_standalone_context  # its stubs know no backend by name
            self._gl: Any = standalone(require=330, backend="egl")
        except Exception as error:  # whatever the driver stack raises: it is not there
            why = " ".join(str(error).split()) or type(error).__name__
            raise MissingExtraError(
                f"There is no EGL to render with ({why[:200]}).",
                hint="Run: apt install libegl1 libgl1-mesa-dri",
            ) from error
        gl = self._gl
        gl.front_face = "cw"  # the image's y grows downwards
        self._engine = f"OpenGL, {gl.info['GL_RENDERER']}"
        self._targets: dict[tuple[int, int], _Target] = {}
        self._noise = _noise_texture(gl)
        self._shadow_map = gl.depth_texture((_SHADOW_PX, _SHADOW_PX))
        self._shadow_map.compare_func = "<="
        self._shadow_frame = gl.framebuffer(depth_attachment=self._shadow_map)
        self._solids = _SolidsDrawer(gl)
        self._ground = _GroundDrawer(gl)
        self._sky = gl.program(vertex_shader=shader("SKY_VERTEX"), fragment_shader=shader("SKY_FRAGMENT"))
        self._sky_uniforms = _Uniforms(self._sky)
        self._sky_array = gl.vertex_array(self._sky, [])
        square = np.array([[-1, -1], [1, -1], [-1, 1], [1, 1]], np.float32)
        self._square = gl.buffer(square.tobytes())
        self._glow = gl.program(vertex_shader=shader("GLOW_VERTEX"), fragment_shader=shader("GLOW_FRAGMENT"))
        self._glow_uniforms = _Uniforms(self._glow)
        self._glow_rows = _Stream(gl)
        self._fall = gl.program(vertex_shader=shader("FALL_VERTEX"), fragment_shader=shader("FALL_FRAGMENT"))
        self._fall_rows = _Stream(gl)

    @property
    def engine(self) -> str:
        """Name of the renderer, for people."""
        return self._engine

    def close(self) -> None:
        """Give its memory back."""
        self._gl.release()

    @contextmanager
    def _drawing(self, scene: CameraScene, light: Light) -> Generator[None]:
        with self._gl:
            self._shadow_matrix = self._cast_shadows(scene, light)
            self._ground.load(scene)
            yield

    def _draw(self, shot: Shot) -> tuple[NDArray[np.uint8], Callable[[], Masks]]:
        return self._picture(shot), lambda: self._masks(shot.point, shot.solids)

    # Passes -----------------------------------------------------------------------------------------------------------

    def _cast_shadows(self, scene: CameraScene, light: Light) -> FloatArray:
        """Draw the shadow map; the matrix from the scene to it (its coordinates 0 to 1)."""
        middle = np.array([*scene.ego.place(18.0, 0.0), 0.0])
        ahead = -np.array(light.sun)
        right = np.cross(ahead, (0.0, 0.0, 1.0))
        right /= np.linalg.norm(right)
        turn = np.stack([right, np.cross(ahead, right), ahead])
        view = np.eye(4)
        view[:3, :3], view[:3, 3] = turn, -turn @ middle
        scale = np.diag([1.0 / _SHADOW_REACH_M, 1.0 / _SHADOW_REACH_M, 1.0 / 160.0, 1.0])
        clip = scale @ view
        if light.shadows > _FAINT:
            solids = together([scene.view.solids, scene.movable, scene.ego_solids])
            solids = solids.chosen(solids.radii > _SHADOWLESS_M)
            places = solids.rows[:, :3] @ turn.T.astype(np.float32) - (turn @ middle).astype(np.float32)
            near = np.abs(places[:, :2]).max(axis=1) < _SHADOW_REACH_M + solids.radii
            self._shadow_frame.use()
            self._shadow_frame.clear(depth=1.0)
            self._gl.enable_only(self._gl.DEPTH_TEST)
            self._gl.depth_func = "<="
            self._solids.draw_plainly(solids.chosen(near), {"u_clip": _matrix(clip)}, "depth")
        bias = np.eye(4)
        bias[:3, :3] *= 0.5
        bias[:3, 3] = 0.5
        return bias @ clip

    def _picture(self, shot: Shot) -> NDArray[np.uint8]:
        scene, point, light, conditions = shot.scene, shot.point, shot.light, shot.conditions
        gl, camera = self._gl, point.camera
        target = self._target(camera)
        target.colour_frame.use()
        gl.viewport = (0, 0, camera.width, camera.height)
        target.colour_frame.clear(*light.air, depth=1.0)
        self._noise.use(0)
        self._shadow_map.use(1)
        given = _uniforms(scene, point, light, conditions, shot.look, self._shadow_matrix)
        variant = " ".join(word for word, on in (("SHADOWS", light.shadows > _FAINT), ("HEAD", conditions.lamps)) if on)
        gl.enable_only(gl.DEPTH_TEST)
        gl.depth_func = "<"
        gl.enable(gl.CULL_FACE)
        self._solids.draw(shot.solids, given, variant)
        gl.disable(gl.CULL_FACE)
        self._ground.draw(given, variant)
        gl.depth_func = "<="
        self._sky_uniforms.give(given)
        self._sky_array.render(vertices=3)
        gl.enable_only(gl.BLEND | gl.DEPTH_TEST)
        gl.blend_func = gl.ONE, gl.ONE_MINUS_SRC_ALPHA
        target.colour_frame.depth_mask = False
        if len(scene.glows):
            self._glow_uniforms.give(given)
            rows = self._glow_rows.load(scene.glows)
            array = gl.vertex_array(
                self._glow,
                [
                    (self._square, "2f", "in_corner"),
                    (rows, "3f 3f 3f 4f 1f/i", "i_place", "i_ax", "i_ay", "i_colour", "i_kind"),
                ],
            )
            array.render(gl.TRIANGLE_STRIP, instances=len(scene.glows))
            array.release()
        drops = falling(camera, conditions, light, scene.seed, scene.tick, shot.index)
        if len(drops):
            gl.enable_only(gl.BLEND)
            rows = self._fall_rows.load(drops)
            layout = "4f 4f 1f/i"
            assert drops.shape[1] == FALL
            array = gl.vertex_array(
                self._fall,
                [(self._square, "2f", "in_corner"), (rows, layout, "i_at", "i_look", "i_slant")],
            )
            array.render(gl.TRIANGLE_STRIP, instances=len(drops))
            array.release()
        target.colour_frame.depth_mask = True
        data = target.read_colour()
        return np.frombuffer(data, np.uint8).reshape(camera.height, camera.width, 3)

    def _masks(self, point: Viewpoint, solids: Solids) -> Masks:
        gl, camera = self._gl, point.camera
        target = self._target(camera)

        def draw(ground: bool, chosen: Solids) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
            frame = target.truth_frame
            frame.use()
            gl.viewport = (0, 0, camera.width, camera.height)
            frame.clear(0.0, 0.0, 0.0, 0.0, depth=1.0)
            gl.enable_only(gl.DEPTH_TEST)
            given = {"u_clip": _matrix(point.clip)}
            gl.depth_func = "<"
            gl.enable(gl.CULL_FACE)
            self._solids.draw_plainly(chosen, given, "truth")
            gl.disable(gl.CULL_FACE)
            if ground:
                self._ground.draw_truth(given)
            shape = (camera.height, camera.width)
            labels = np.frombuffer(frame.read(components=4, attachment=0, alignment=1), np.uint8).reshape(*shape, 4)
            depths = np.frombuffer(frame.read(components=1, attachment=1, dtype="f4"), np.float32).reshape(shape)
            return labels, depths

        labels, depths = draw(True, solids)
        low, high = labels[..., 0].astype(np.uint16), labels[..., 1].astype(np.uint16)
        instances = np.bitwise_or(low, np.left_shift(high, np.uint16(8)), dtype=np.uint16)
        classes = np.where(labels[..., 3] > 0, labels[..., 2], 0).astype(np.uint8)
        depth = np.where(labels[..., 3] > 0, depths, np.float32(np.inf)).astype(np.float32)

        def alone(number: int) -> int:
            only = solids.chosen(solids.rows[:, INSTANCE] == number)
            own, _ = draw(False, only)
            return int((own[..., 3] > 0).sum())

        return Masks(instances, classes, depth, alone)

    def _target(self, camera: Camera) -> _Target:
        size = camera.width, camera.height
        if size not in self._targets:
            self._targets[size] = _Target(self._gl, size)
        return self._targets[size]


class _Target:
    """Frame buffers of one image size."""

    def __init__(self, gl: Any, size: tuple[int, int]) -> None:
        self.size = size
        self.colour_frame = gl.framebuffer([gl.renderbuffer(size, 4)], gl.depth_renderbuffer(size))
        self.truth_frame = gl.framebuffer(
            [gl.texture(size, 4), gl.texture(size, 1, dtype="f4")], gl.depth_renderbuffer(size)
        )

    def read_colour(self) -> bytes:
        """(H, W, 3) as bytes."""
        return self.colour_frame.read(components=3, alignment=1)


class _Stream:
    """A buffer that grows to what is loaded into it."""

    def __init__(self, gl: Any) -> None:
        self._gl = gl
        self._buffer: Any = gl.buffer(reserve=4096)

    def load(self, rows: RowArray) -> Any:
        data = np.ascontiguousarray(rows, np.float32).tobytes()
        if len(data) > self._buffer.size:
            self._buffer.release()
            self._buffer = self._gl.buffer(reserve=2 * len(data))
        self._buffer.orphan(self._buffer.size)
        self._buffer.write(data)
        return self._buffer


class _Programs:
    """Programs by name and variant, compiled when they are first used.

    A variant is what a picture needs: `SHADOWS` cast by the sun, `HEAD` lamps of the ego. Nothing is computed in vain.
    """

    def __init__(self, gl: Any, sources: dict[str, tuple[str, str]]) -> None:
        self._gl, self._sources = gl, sources
        self._made: dict[tuple[str, str], tuple[Any, _Uniforms]] = {}

    def get(self, name: str, variant: str) -> tuple[Any, _Uniforms]:
        """(program, its uniforms)."""
        key = name, variant
        if key not in self._made:
            head = "#version 330\n" + "".join(f"#define {word}\n" for word in variant.split())
            vertex, fragment = (source.replace("#version 330\n", head, 1) for source in self._sources[name])
            program = self._gl.program(vertex_shader=vertex, fragment_shader=fragment)
            self._made[key] = program, _Uniforms(program)
        return self._made[key]


class _SolidsDrawer:
    """Draws solids, a call for each mesh and material."""

    def __init__(self, gl: Any) -> None:
        self._gl = gl
        lit = shader("SOLID_VERTEX").replace("#version 330\n", "#version 330\n#define LIT\n", 1)
        truth = shader("SOLID_VERTEX").replace("#version 330\n", "#version 330\n#define TRUTH\n", 1)
        self._programs = _Programs(
            gl,
            {name: (lit, source) for name, source in _FRAGMENTS.items()}
            | {
                "truth": (truth, shader("TRUTH_SOLID_FRAGMENT")),
                "depth": (shader("SOLID_VERTEX"), shader("DEPTH_FRAGMENT")),
            },
        )
        self._meshes: dict[Shape, tuple[Any, Any]] = {}
        for shape in Shape:
            vertices, triangles = mesh_of(shape)
            self._meshes[shape] = (
                gl.buffer(vertices.astype(np.float32).tobytes()),
                gl.buffer(triangles.astype(np.int32).tobytes()),
            )
        self._room = 0
        self._rows: dict[tuple[Shape, str], Any] = {}
        self._arrays: dict[tuple[Shape, str, int], Any] = {}
        self._grow(512)

    def _grow(self, room: int) -> None:
        for kept in (*self._arrays.values(), *self._rows.values()):
            kept.release()
        self._arrays.clear()
        self._room = room
        self._rows = {bucket: self._gl.buffer(reserve=room * 4 * _INSTANCE) for bucket in _BUCKETS}

    def _array(self, bucket: tuple[Shape, str], program: Any) -> Any:
        key = (*bucket, program.glo)
        if key not in self._arrays:
            vertices, triangles = self._meshes[bucket[0]]
            self._arrays[key] = self._gl.vertex_array(
                program,
                [
                    _buffer(program, vertices, (("3f", "in_place"), ("3f", "in_normal")), ""),
                    _buffer(program, self._rows[bucket], _INSTANCE_LAYOUT, "/i"),
                ],
                triangles,
            )
        return self._arrays[key]

    def _load(self, solids: Solids) -> list[tuple[tuple[Shape, str], int]]:
        given = solids.rows
        rows = np.empty((len(given), _INSTANCE), np.float32)
        rows[:, 0], rows[:, 1] = np.cos(given[:, YAW]), np.sin(given[:, YAW])
        rows[:, 2], rows[:, 3] = np.cos(given[:, PITCH]), np.sin(given[:, PITCH])
        rows[:, 4:7], rows[:, 7:] = given[:, X : Z + 1], given[:, SX:]
        group = _MATERIAL_GROUPS[given[:, MATERIAL].astype(np.int64)]
        chosen = {
            (shape, name): np.nonzero((solids.shapes == shape) & (group == _GROUPS.index(name)))[0]
            for shape, name in _BUCKETS
        }
        most = max(len(which) for which in chosen.values())
        if most > self._room:
            self._grow(2 * most)
        found: list[tuple[tuple[Shape, str], int]] = []
        for bucket, which in chosen.items():
            if len(which):
                buffer = self._rows[bucket]
                buffer.orphan(buffer.size)
                buffer.write(rows[which].tobytes())
                found.append((bucket, len(which)))
        return found

    def draw(self, solids: Solids, given: dict[str, Any], variant: str) -> None:
        """Lit."""
        for bucket, count in self._load(solids):
            program, uniforms = self._programs.get(bucket[1], variant)
            uniforms.give(given)
            self._array(bucket, program).render(instances=count)

    def draw_plainly(self, solids: Solids, given: dict[str, Any], use: str) -> None:
        """For `truth` (instance, class, depth) or for `depth` alone."""
        program, uniforms = self._programs.get(use, "")
        uniforms.give(given)
        for bucket, count in self._load(solids):
            self._array(bucket, program).render(instances=count)


def _buffer(program: Any, buffer: Any, layout: tuple[tuple[str, str], ...], rate: str) -> tuple[Any, ...]:
    """A buffer for a vertex array, the numbers skipped that a program does not read."""
    pieces = [piece if name in program else f"{int(piece[0]) * 4}x" for piece, name in layout]
    return buffer, " ".join(pieces) + rate, *[name for _, name in layout if name in program]


class _GroundDrawer:
    """Draws the land and what is paved, what lies on top first: it hides what lies under it."""

    def __init__(self, gl: Any) -> None:
        self._gl = gl
        vertex = shader("GROUND_VERTEX")
        self._programs = _Programs(
            gl,
            {
                "paint": (vertex, shader("PAINT_FRAGMENT")),
                "lane": (vertex, shader("LANE_FRAGMENT")),
                "pavement": (vertex, shader("PAVEMENT_FRAGMENT")),
                "terrain": (vertex, shader("TERRAIN_FRAGMENT")),
                "truth": (vertex, shader("TRUTH_GROUND_FRAGMENT")),
            },
        )
        self._arrays: dict[tuple[str, int], tuple[Any, Any]] = {}
        self._streams = {name: _Stream(gl) for name in _GROUND_ORDER}
        self._counts: dict[str, int] = dict.fromkeys(_GROUND_ORDER, 0)
        self._buffers: dict[str, Any] = {}
        self._loaded: tuple[int, bytes] | None = None
        self._view: PlaceView | None = None

    def load(self, scene: CameraScene) -> None:
        """Take the ground of a scene."""
        key = (id(scene.view), scene.lines.tobytes())
        if self._loaded == key:
            return
        self._view = scene.view  # keeps the id from being another's
        triangles = np.concatenate([scene.view.triangles, scene.lines])
        kinds = triangles[:, 0, 7]
        lot_pad = (kinds == Paving.LOT) & (triangles[:, 0, 4] > 100.0)
        half = 700.0
        corners = np.zeros((2, 3, VERTEX), np.float32)
        corners[0, :, :2] = (-half, -half), (half, -half), (half, half)
        corners[1, :, :2] = (-half, -half), (half, half), (-half, half)
        corners[:, :, :2] += (scene.ego.x_m, scene.ego.y_m)
        layers = {"terrain": corners}
        for name, kept in _GROUND_LAYERS.items():
            chosen = np.isin(kinds, kept)
            chosen = chosen & ~lot_pad if name == "lane" else chosen | lot_pad if name == "pavement" else chosen
            layers[name] = triangles[chosen]
        for name, rows in layers.items():
            self._counts[name] = len(rows) * 3
            self._buffers[name] = self._streams[name].load(rows.reshape(-1, VERTEX))
        self._loaded = key

    def draw(self, given: dict[str, Any], variant: str) -> None:
        """Lit."""
        for name in _GROUND_ORDER:
            self._draw(name, *self._programs.get(name, variant), given)

    def draw_truth(self, given: dict[str, Any]) -> None:
        """Class and depth."""
        for name in _GROUND_ORDER:
            self._draw(name, *self._programs.get("truth", ""), given)

    def _draw(self, name: str, program: Any, uniforms: _Uniforms, given: dict[str, Any]) -> None:
        if not self._counts[name]:
            return
        uniforms.give(given)
        buffer, key = self._buffers[name], (name, program.glo)
        kept = self._arrays.get(key)
        if kept is None or kept[0] is not buffer:
            if kept is not None:
                kept[1].release()
            layout = (("2f", "in_place"), ("2f", "in_lane"), ("4f", "in_info"))
            kept = buffer, self._gl.vertex_array(program, [_buffer(program, buffer, layout, "")])
            self._arrays[key] = kept
        kept[1].render(vertices=self._counts[name])


def _uniforms(
    scene: CameraScene,
    point: Viewpoint,
    light: Light,
    conditions: Conditions,
    look: CameraLook,
    shadow_matrix: FloatArray,
) -> dict[str, Any]:
    camera = point.camera
    front = scene.ego.ahead(scene.ego_size_m[0] / 2.0)
    heading = scene.ego.heading_rad
    return {
        "u_clip": _matrix(point.clip),
        "u_unproject": _matrix(point.unproject),
        "u_cam": tuple(point.position_m),
        "u_right": tuple(point.rotation[:, 0]),
        "u_up": tuple(-point.rotation[:, 1]),
        "u_sun": light.sun,
        "u_sun_light": light.sun_light,
        "u_sky_light": light.sky_light,
        "u_ground_light": light.ground_light,
        "u_air": light.air,
        "u_zenith": light.zenith,
        "u_horizon": light.horizon,
        "u_terrain": light.terrain,
        "u_mist": light.mist,
        "u_cloud": conditions.cloud,
        "u_extinction": conditions.extinction,
        "u_night": conditions.night,
        "u_wet": conditions.wet,
        "u_snow": conditions.snow,
        "u_ego": (front.x_m, front.y_m, math.cos(heading), math.sin(heading)),
        "u_head": conditions.night if conditions.lamps else 0.0,
        "u_grade": (look.exposure, look.contrast, look.saturation),
        "u_tint": look.tint,
        "u_lens": (look.vignette, float(camera.width), float(camera.height), 0.0),
        "u_shadow_matrix": _matrix(shadow_matrix),
        "u_shadows": light.shadows,
        "u_noise": 0,
        "u_shadow_map": 1,
    }


class _Uniforms:
    """Uniforms of a program that the compiler left in it."""

    def __init__(self, program: Any) -> None:
        import moderngl

        members = {name: program[name] for name in program}
        self._members = {name: one for name, one in members.items() if isinstance(one, moderngl.Uniform)}

    def give(self, given: dict[str, Any]) -> None:
        """Set those of the values that the program reads."""
        for name, member in self._members.items():
            value = given[name]
            if isinstance(value, bytes):
                member.write(value)
            else:
                member.value = value


def _matrix(value: FloatArray) -> bytes:
    """As OpenGL takes it: column by column."""
    return np.ascontiguousarray(value.T, np.float32).tobytes()


def _noise_texture(gl: Any) -> Any:
    """Smooth noise that repeats, 256 x 256; always the same."""
    rng = np.random.default_rng(20)
    size = 256
    total = np.zeros((size, size))
    for cells, weight in ((8, 0.42), (32, 0.33), (128, 0.25)):
        lattice = rng.random((cells, cells))
        at = np.arange(size) * cells / size
        low, share = np.floor(at).astype(int) % cells, at % 1.0
        share = share * share * (3.0 - 2.0 * share)
        high = (low + 1) % cells
        rows = lattice[low] * (1.0 - share)[:, None] + lattice[high] * share[:, None]
        total += weight * (rows[:, low] * (1.0 - share) + rows[:, high] * share)
    low, high = np.quantile(total, (0.01, 0.99))
    data = (np.clip((total - low) / (high - low), 0.0, 1.0) * 255.0).astype(np.uint8)
    texture = gl.texture((size, size), 1, data.tobytes())
    texture.build_mipmaps()
    texture.filter = (gl.LINEAR_MIPMAP_NEAREST, gl.LINEAR)
    texture.repeat_x = texture.repeat_y = True
    return texture
