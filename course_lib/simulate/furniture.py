"""Furniture and small things for virtual rooms; each function returns a list of `Surface`, in the world frame.

``at`` is where the middle of the thing's foot stands, ``yaw`` its turn about the vertical in degrees; fronts face -y.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from course_lib.geometry.transforms import rotation_z
from course_lib.simulate import pictures, shapes, textures
from course_lib.simulate.scene_model import Surface
from course_lib.simulate.textures import Colour

Rng = np.random.Generator
Painter = Callable[[Rng, tuple[int, int]], np.ndarray]
Point = Sequence[float]

OAK, WALNUT, PINE = (186, 140, 94), (112, 74, 50), (206, 168, 118)


def placed(at: Point, yaw: float = 0.0) -> np.ndarray:
    """(4, 4) motion of a thing from the origin to its place."""
    T = rotation_z(np.radians(yaw))
    T[:3, 3] = at
    return T


def one_colour(colour: Colour) -> Painter:
    """A painter for small or hidden faces."""
    return lambda rng, shape: np.full((2, 2, 3), np.clip(colour, 0, 255), np.uint8)


def painted(colour: Colour, grain: float = 0.02) -> Painter:
    """A painter of plain paint."""
    return lambda rng, shape: textures.plain(rng, shape, colour, grain)


def wooden(colour: Colour) -> Painter:
    """A painter of wood whose grain runs along the longer side."""

    def paint(rng: Rng, shape: tuple[int, int]) -> np.ndarray:
        if shape[0] <= shape[1]:
            return textures.wood(rng, shape, colour)
        return np.ascontiguousarray(textures.wood(rng, shape[::-1], colour).swapaxes(0, 1))

    return paint


def block(
    rng: Rng,
    name: str,
    size: Point,
    at: Point,
    yaw: float = 0.0,
    paint: Painter | None = None,
    faces: Mapping[str, np.ndarray] | None = None,
    texel: float = 0.004,
    T: np.ndarray | None = None,
    detail: float = 1.0,
) -> list[Surface]:
    """A box: ``paint`` on every face but those with their own picture in ``faces``; ``T`` moves it once more."""
    motion = placed(at, yaw) if T is None else T @ placed(at, yaw)
    paint = paint or painted((200, 200, 200))
    out = []
    for face, patch in shapes.box(size).items():
        width = size[1] if face in ("left", "right") else size[0]
        height = size[1] if face in ("top", "bottom") else size[2]
        picture = (faces or {}).get(face)
        if picture is None:
            picture = paint(rng, textures.shape_of(width, height, texel))
        out.append(Surface(name, patch.moved(motion), picture, detail=detail))
    return out


def round_thing(
    name: str, profile: Sequence[Point], at: Point, picture: np.ndarray, glow: float = 0.0, yaw: float = 0.0
) -> Surface:
    """A turned thing with a picture around it."""
    return Surface(name, shapes.turned(profile, 36).moved(placed(at, yaw)), picture, glow)


def table(rng: Rng, at: Point, size: Point = (1.4, 0.8, 0.75), colour: Colour = OAK, yaw: float = 0.0) -> list[Surface]:
    """A table of width, depth and height ``size``, with four legs and an apron."""
    T, (w, d, h) = placed(at, yaw), size
    paint, dark = wooden(colour), wooden(np.asarray(colour) * 0.86)
    out = block(rng, "table", (w, d, 0.035), (0, 0, h - 0.035), paint=paint, texel=0.002, T=T, detail=4)
    for x in (-1, 1):
        for y in (-1, 1):
            foot = (x * (w / 2 - 0.07), y * (d / 2 - 0.07), 0)
            out += block(rng, "table", (0.06, 0.06, h - 0.035), foot, paint=dark, T=T)
        out += block(rng, "table", (0.02, d - 0.2, 0.08), (x * (w / 2 - 0.07), 0, h - 0.115), paint=dark, T=T)
        out += block(rng, "table", (w - 0.2, 0.02, 0.08), (0, x * (d / 2 - 0.07), h - 0.115), paint=dark, T=T)
    return out


def chair(rng: Rng, at: Point, yaw: float = 0.0, colour: Colour = (58, 92, 104)) -> list[Surface]:
    """A painted chair with a slatted back; somebody on it looks towards +y."""
    T, paint = placed(at, yaw), painted(colour, 0.03)
    out = block(rng, "chair", (0.42, 0.40, 0.03), (0, 0, 0.44), paint=wooden(PINE), T=T)
    for x in (-0.185, 0.185):
        out += block(rng, "chair", (0.035, 0.035, 0.44), (x, 0.175, 0), paint=paint, T=T)
        out += block(rng, "chair", (0.035, 0.035, 0.93), (x, -0.19, 0), paint=paint, T=T)
        out += block(rng, "chair", (0.022, 0.33, 0.03), (x, -0.008, 0.22), paint=paint, T=T)
    for x in (-0.11, -0.037, 0.037, 0.11):
        out += block(rng, "chair", (0.032, 0.018, 0.32), (x, -0.19, 0.54), paint=paint, T=T)
    out += block(rng, "chair", (0.335, 0.022, 0.05), (0, -0.19, 0.50), paint=paint, T=T)
    out += block(rng, "chair", (0.335, 0.022, 0.07), (0, -0.19, 0.855), paint=paint, T=T)
    return out


def sideboard(rng: Rng, at: Point, yaw: float = 0.0, size: Point = (1.5, 0.40, 0.62)) -> list[Surface]:
    """A low cupboard with three doors and round knobs."""
    T, (w, d, h) = placed(at, yaw), size
    out = block(rng, "sideboard", (w, d, h - 0.14), (0, 0, 0.12), paint=wooden(WALNUT), T=T)
    out += block(rng, "sideboard", (w + 0.03, d + 0.02, 0.02), (0, 0, h - 0.02), paint=wooden(OAK), T=T)
    for k in (-1, 0, 1):
        door = (w / 3 - 0.02, 0.018, h - 0.19)
        out += block(rng, "sideboard", door, (k * w / 3, -d / 2 - 0.005, 0.145), paint=wooden(OAK), T=T)
        knob = shapes.sphere(0.014, 16).moved(T @ placed((k * w / 3 + w / 8, -d / 2 - 0.022, h / 2)))
        out.append(Surface("sideboard", knob, textures.plain(rng, (8, 8), (60, 56, 52))))
    for x in (-1, 1):
        foot = (x * (w / 2 - 0.08), 0, 0)
        out += block(rng, "sideboard", (0.05, d - 0.06, 0.12), foot, paint=painted((52, 44, 40)), T=T)
    return out


def armchair(rng: Rng, at: Point, yaw: float = 0.0, colour: Colour = (172, 118, 58)) -> list[Surface]:
    """A soft armchair, as one smooth solid."""
    boxes = (  # centre, half size, radius of the rounding
        ((0, 0, 0.25), (0.36, 0.34, 0.10), 0.05),
        ((0, -0.03, 0.39), (0.27, 0.30, 0.06), 0.05),
        ((0, 0.29, 0.58), (0.33, 0.08, 0.30), 0.07),
        ((-0.36, -0.01, 0.40), (0.07, 0.33, 0.20), 0.06),
        ((0.36, -0.01, 0.40), (0.07, 0.33, 0.20), 0.06),
        *(((x, y, 0.08), (0.025, 0.025, 0.08), 0.02) for x in (-0.33, 0.33) for y in (-0.28, 0.3)),
    )

    def distance(p: np.ndarray) -> np.ndarray:
        total = np.full(len(p), 1.0)
        for centre, half, radius in boxes:
            q = np.abs(p - np.asarray(centre)) - (np.asarray(half) - radius)
            outside = np.sqrt(np.sum(np.maximum(q, 0) ** 2, 1))
            one = outside + np.minimum(q.max(1), 0) - radius
            h = np.maximum(0.03 - np.abs(total - one), 0) / 0.03
            total = np.minimum(total, one) - h * h * h * 0.03 / 6
        return total

    vertices, triangles = shapes.closed_surface(distance, (-0.6, -0.6, -0.1), (0.6, 0.6, 1.05), 0.04)
    slope = shapes.gradient(distance, vertices)
    normals = slope / np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-9)
    solid = shapes.Solid(vertices, triangles, normals, np.zeros(len(vertices), np.uint8)).placed(placed(at, yaw))
    shade = 1 + 0.10 * rng.standard_normal(len(vertices))
    paint = np.asarray(colour) * shade[:, None] * np.where(vertices[:, 2:] < 0.14, 0.35, 1.0)
    return [Surface("armchair", solid, paint.clip(0, 255).astype(np.uint8))]


def floor_lamp(rng: Rng, at: Point, height: float = 1.65) -> list[Surface]:
    """A lamp on a pole with a shining shade."""
    metal = textures.plain(rng, (8, 8), (66, 62, 58))
    stand = shapes.sharp([(0, height), (0.012, height), (0.012, 0.03), (0.15, 0.02), (0.15, 0), (0, 0)])
    shade = [(0.11, height + 0.14), (0.20, height - 0.16)]
    warm = textures.tint((255, 226, 170), 0.04 * textures.noise(rng, (40, 120), 10, 2))
    return [
        round_thing("lamp", stand, at, metal),
        round_thing("lamp", shade, at, warm, glow=1.15),
        round_thing("lamp", [(r - 0.004, z) for r, z in shade[::-1]], at, warm, glow=1.3),
    ]


def plant(rng: Rng, at: Point, leaves: int = 22, height: float = 0.75) -> list[Surface]:
    """A pot with long bent leaves."""
    pot = [(0, 0.20), (0.11, 0.20), (0.12, 0.25), (0.14, 0.25), (0.115, 0), (0, 0)]
    bands = textures.tint((196, 108, 72), 0.03 * textures.noise(rng, (60, 200), 8, 2))
    bands[12:18] = (236, 222, 196)
    out = [round_thing("plant", shapes.sharp(pot), at, bands)]
    s = np.linspace(0, 1, 9)
    for k in range(leaves):
        turn, lean = 2 * np.pi * k / leaves * 2.6 + rng.uniform(-0.2, 0.2), rng.uniform(0.10, 0.42)
        tall = height * rng.uniform(0.55, 1.0)
        reach = lean * (s + 1.3 * s**3) * 0.5
        rise = 0.2 + tall * (s - 0.45 * lean / 0.42 * s**3)
        width = 0.028 * np.sin(np.pi * np.clip(s * 0.93 + 0.07, 0, 1)) ** 0.7
        out_way, side = np.array([np.cos(turn), np.sin(turn), 0]), np.array([-np.sin(turn), np.cos(turn), 0])
        middle = reach[:, None] * out_way + rise[:, None] * (0, 0, 1) + np.asarray(at)
        edge = width[:, None] * side
        grid = np.stack([middle + edge, middle - 0.004 * out_way, middle - edge], 1)[::-1]
        green = np.array((64, 122, 62)) * rng.uniform(0.75, 1.25) * (1, 1, rng.uniform(0.7, 1.1))
        leaf = textures.plain(rng, (60, 12), green, 0.05)
        leaf[:, 5:7] = np.clip(leaf[:, 5:7] * 1.35, 0, 255)
        out.append(Surface("plant", shapes.curved(grid), leaf, two_sided=True))
    return out


def mug(rng: Rng, at: Point, colour: Colour = (204, 70, 52), yaw: float = 0.0) -> list[Surface]:
    """A striped mug with a handle and coffee in it."""
    outside = shapes.sharp([(0.036, 0.088), (0.038, 0.095), (0.041, 0.095), (0.041, 0.012), (0.036, 0), (0, 0)])
    picture = np.empty((48, 160, 3), np.uint8)
    picture[:] = (240, 236, 226)
    picture[10:22] = picture[28:32] = np.asarray(colour, np.uint8)
    inside = [(0, 0.075), (0.036, 0.075), (0.036, 0.088)]
    coffee = textures.plain(rng, (12, 12), (74, 46, 30))
    coffee[6:] = (240, 236, 226)
    a = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 11)
    b = np.linspace(0, 2 * np.pi, 9)
    centre = np.stack([0.040 + 0.026 * np.cos(a), 0 * a, 0.05 + 0.027 * np.sin(a)], -1)
    ring = np.stack([np.cos(a), 0 * a, np.sin(a)], -1)
    tube = centre[:, None] + 0.0055 * (np.cos(b)[None, :, None] * ring[:, None] + np.sin(b)[None, :, None] * (0, 1, 0))
    T = placed(at, yaw)
    handle = shapes.curved(tube[::-1]).moved(T)
    return [
        round_thing("mug", outside, at, picture, yaw=yaw),
        Surface("mug", shapes.turned(inside).moved(T), coffee),
        Surface("mug", handle, textures.plain(rng, (8, 8), (240, 236, 226))),
    ]


def hanging(rng: Rng, picture: np.ndarray, centre: Point, width: float, yaw: float = 0.0) -> list[Surface]:
    """A framed picture, ``width`` metres wide, its back's centre at ``centre``, facing -y if yaw is 0."""
    height = width * picture.shape[0] / picture.shape[1]
    T = placed(np.asarray(centre) - (0, 0, height / 2), yaw)
    dark = painted((46, 38, 34))
    rim = 0.022
    out = block(rng, "poster", (width, 0.012, height), (0, -0.006, 0), paint=dark, faces={"front": picture}, T=T)
    for x in (-1, 1):
        side = (x * (width + rim) / 2, -0.012, -rim)
        out += block(rng, "poster", (rim, 0.024, height + 2 * rim), side, paint=dark, T=T)
    for z in (-rim, height):
        out += block(rng, "poster", (width, 0.024, rim), (0, -0.012, z), paint=dark, T=T)
    return out


def printed_box(rng: Rng, at: Point, yaw: float, size: Point = (0.26, 0.18, 0.20)) -> list[Surface]:
    """The black carton with white text."""
    texel = 0.0006
    lines = {
        "front": ("POINT", "CLOUD"),
        "back": ("POINT", "CLOUD"),
        "left": ("x y z", "r g b"),
        "right": ("x y z", "r g b"),
        "top": ("3D", "this side up"),
    }
    w, d, h = size
    sizes = {"front": (w, h), "back": (w, h), "left": (d, h), "right": (d, h), "top": (w, d)}
    faces = {side: pictures.printed_box(*textures.shape_of(*sizes[side], texel), text) for side, text in lines.items()}
    return block(rng, "box", size, at, yaw, painted((30, 30, 33)), faces)


def animal(seed: int, at: Point, yaw: float, scale: float, spacing: float) -> list[Surface]:
    """The animal of the course, glazed clay; it looks towards +x turned by yaw."""
    solid = shapes.organic_shape(spacing, seed)
    return [Surface("animal", solid.placed(placed(at, yaw), scale), shapes.animal_colors(solid, seed))]
