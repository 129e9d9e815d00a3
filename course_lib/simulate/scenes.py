"""The scenes of the course: a living room and a desk. World frame: z up, the floor at z = 0, metres."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from course_lib.geometry.transforms import look_at
from course_lib.simulate import books, furniture, pictures, shapes, textures
from course_lib.simulate.furniture import block, painted, round_thing, wooden
from course_lib.simulate.lighting import bulb_light, window_light
from course_lib.simulate.scene_model import NOTHING, Scene, Surface

__all__ = ["NOTHING", "Scene", "Surface", "check_seed", "desk", "living_room"]

# The corners of the living room's floor, seen from above against the clock: an L, so that the view reaches 5 m.
ROOM = ((-2.5, -2.3), (2.6, -2.3), (2.6, 3.5), (0.95, 3.5), (0.95, 1.95), (-2.5, 1.95))
HEIGHT = 2.6
TABLE = (0.0, 0.15, 0.755)  # where things are put down: 5 mm above the middle of its top
DESK_TOP = 0.74  # height of the desk's top
WINDOW = (-2.5, (-0.9, 0.7), (0.95, 2.15))  # x; y and z from–to


def check_seed(seed: int) -> int:
    """Return the seed if it is one, else raise ValueError."""
    if isinstance(seed, bool) or not isinstance(seed, (int, np.integer)) or seed < 0:
        raise ValueError(f"A seed must be a non-negative integer, not {seed!r}.")
    return int(seed)


def living_room(seed: int = 0) -> Scene:
    """A furnished room of 5 x 6 m in the shape of an L, with a table in its middle and things on it.

    Parameters
    ----------
    seed : decides grain, books, leaves and small turns; the places of things stay.

    Returns
    -------
    Scene with the views "overview", "window", "table" (1.5 m from the middle of the table), "blank_wall" (plain paint:
    registration slides), "too_near" (a chair too near for a D455) and "slats" (thin things before a far wall).
    """
    rng = np.random.default_rng([check_seed(seed), 101])
    surfaces = _walls(rng) + _window(rng)
    rug = textures.rug(rng, textures.shape_of(2.5, 1.7, 0.0035))
    surfaces += block(rng, "rug", (2.5, 1.7, 0.012), (0.05, 0.0, 0), 0, painted((90, 40, 40)), {"top": rug}, detail=2)
    surfaces += furniture.table(rng, (TABLE[0], TABLE[1], 0))
    surfaces += _on_the_table(rng, seed)
    surfaces += furniture.chair(rng, (-0.52, -0.52, 0), 14 + rng.uniform(-4, 4))
    surfaces += furniture.chair(rng, (0.62, 0.98, 0), 196 + rng.uniform(-6, 6), (150, 60, 50))
    surfaces += furniture.sideboard(rng, (-1.05, 1.72, 0))
    surfaces += books.lying_books(rng, (-1.50, 1.70, 0.62), 8, 4)
    vase = [(0.028, 0.34), (0.024, 0.30), (0.055, 0.21), (0.085, 0.12), (0.075, 0.04), (0.05, 0), (0, 0)]
    glaze = textures.tint((64, 128, 138), 0.10 * textures.noise(rng, (90, 140), 25, 4))
    surfaces.append(round_thing("vase", _smooth_profile(vase), (-0.62, 1.70, 0.62), glaze))
    surfaces += books.bookshelf(rng, (1.80, 3.33, 0))
    surfaces += furniture.floor_lamp(rng, (2.32, 2.55, 0))
    surfaces += furniture.armchair(rng, (1.95, 0.95, 0), -62)
    surfaces += furniture.plant(rng, (-2.15, 1.45, 0))
    surfaces += _posters(rng)
    y, z = WINDOW[1], WINDOW[2]
    daylight = window_light(
        (WINDOW[0] + 0.02, y[0], z[0]), (0, y[1] - y[0], 0), (0, 0, z[1] - z[0]), np.multiply((0.93, 1.0, 1.1), 5.5)
    )
    lamps = [
        bulb_light((2.32, 2.55, 1.65), 0.12, np.multiply((1.0, 0.78, 0.5), 0.95)),
        bulb_light((0.2, -0.2, 2.45), 0.20, np.multiply((1.0, 0.9, 0.76), 1.35)),
    ]
    views = {
        "overview": look_at((-2.2, -2.0, 2.35), (0.4, 0.9, 0.55)),
        "window": look_at((2.2, -1.6, 2.1), (-0.7, 0.5, 0.75)),
        "table": look_at((0.15, -1.17, 1.42), (TABLE[0], TABLE[1] + 0.1, 0.86)),
        "blank_wall": look_at((1.55, -0.75, 1.3), (2.6, -0.75, 1.3)),
        "too_near": look_at((-0.55, -0.98, 0.95), (-0.5, 0.4, 0.7)),
        "slats": look_at((-0.72, -1.45, 0.85), (-0.3, 0.9, 0.75)),
    }
    return Scene(surfaces, [daylight, *lamps], (0.22, 0.22, 0.22), views, ("window", "lamp"))


def _walls(rng: np.random.Generator) -> list[Surface]:
    x0, x1, y0, y1 = -2.5, 2.6, -2.3, 3.5
    floor = textures.boards(rng, textures.shape_of(x1 - x0, y1 - y0, 0.0035), 0.0035, (176, 130, 88))
    out = [
        Surface("floor", shapes.rectangle((x0, y1, 0), (x1 - x0, 0, 0), (0, y0 - y1, 0), 0.3), floor, detail=1.6),
        Surface(
            "ceiling",
            shapes.rectangle((x0, y0, HEIGHT), (x1 - x0, 0, 0), (0, y1 - y0, 0), 0.3),
            textures.plaster(rng, textures.shape_of(x1 - x0, y1 - y0, 0.012), (232, 230, 224)),
        ),
    ]
    paints = ((224, 218, 206), (222, 214, 200), (176, 190, 178), (206, 210, 200), (206, 210, 200), (222, 214, 200))
    for (ax, ay), (bx, by), colour in zip(ROOM, ROOM[1:] + ROOM[:1], paints, strict=True):
        along, length = np.array([bx - ax, by - ay, 0.0]), np.hypot(bx - ax, by - ay)
        picture = textures.plaster(rng, textures.shape_of(length, HEIGHT, 0.004), colour)
        # Walked against the clock, the room lies to the left: seen from inside, the wall runs from b to a.
        out.append(Surface("wall", shapes.rectangle((bx, by, HEIGHT), -along, (0, 0, -HEIGHT), 0.3), picture))
        middle = np.array([(ax + bx) / 2, (ay + by) / 2, 0]) + 0.007 * np.array([-along[1], along[0], 0]) / length
        yaw = np.degrees(np.arctan2(along[1], along[0]))
        out += block(rng, "skirting", (length, 0.014, 0.09), middle, yaw, painted((238, 236, 228)))
    door = (1.0, -2.27, 0)
    out += block(rng, "door", (0.95, 0.06, 2.08), door, 180, painted((238, 236, 228)))
    out += block(rng, "door", (0.82, 0.08, 2.00), door, 180, wooden(furniture.PINE))
    handle = shapes.sphere(0.03, 20).moved(furniture.placed((1.33, -2.2, 1.02)))
    out.append(Surface("door", handle, textures.plain(rng, (8, 8), (184, 160, 96))))
    return out


def _window(rng: np.random.Generator) -> list[Surface]:
    x, (ya, yb), (za, zb) = WINDOW
    pane = shapes.rectangle((x + 0.012, ya, zb), (0, yb - ya, 0), (0, 0, za - zb))
    out = [Surface("window", pane, pictures.view_outside(rng), glow=1.9)]
    white, middle = painted((240, 240, 236)), ((ya + yb) / 2, (za + zb) / 2)
    bar = 0.06
    for y in (ya, middle[0], yb):
        out += block(rng, "window frame", (bar, bar, zb - za + bar), (x + 0.03, y, za - bar / 2), 0, white)
    for z in (za, za + 0.68 * (zb - za), zb):
        out += block(rng, "window frame", (bar, yb - ya + bar, bar), (x + 0.03, middle[0], z - bar / 2), 0, white)
    out += block(rng, "window frame", (0.20, yb - ya + 0.24, 0.03), (x + 0.10, middle[0], za - 0.06), 0, white)
    for start, end in ((ya - 0.38, ya + 0.10), (yb - 0.10, yb + 0.38)):
        s, z = np.linspace(0, 1, 61), np.linspace(2.35, 0.12, 5)
        fold = 0.035 * np.sin(2 * np.pi * 5.5 * s + 0.6) + 0.015 * np.sin(2 * np.pi * 2.3 * s)
        grid = np.stack(np.broadcast_arrays(x + 0.11 + fold, start + (end - start) * s, z[:, None]), -1)
        picture = textures.cloth(rng, (300, 200), (126, 142, 168))
        out.append(Surface("curtain", shapes.curved(grid), picture, two_sided=True))
    rail = [(0, 1.25), (0.012, 1.25), (0.012, -1.25), (0, -1.25)]
    lying = np.array([[1.0, 0, 0, x + 0.11], [0, 0, -1.0, middle[0]], [0, 1.0, 0, 2.37], [0, 0, 0, 1]])
    metal = textures.plain(rng, (8, 8), (70, 64, 58))
    return [*out, Surface("curtain", shapes.turned(shapes.sharp(rail), 16).moved(lying), metal)]


def _on_the_table(rng: np.random.Generator, seed: int) -> list[Surface]:
    x, y, z = TABLE
    out = furniture.printed_box(rng, (x - 0.40, y + 0.06, z), 20)
    ball = shapes.sphere(0.10, 44).moved(furniture.placed((x + 0.42, y - 0.07, z + 0.112), rng.uniform(0, 360)))
    out.append(Surface("globe", ball, pictures.globe(rng)))
    stand = [(0.022, 0.022), (0.045, 0.012), (0.05, 0), (0, 0)]
    out.append(round_thing("globe", stand, (x + 0.42, y - 0.07, z), textures.plain(rng, (12, 24), (60, 48, 40))))
    out += furniture.animal(seed, (x + 0.02, y + 0.02, z), -118, 2.1, 0.0038)
    out += furniture.mug(rng, (x + 0.16, y - 0.25, z), yaw=-40)
    out += books.lying_books(rng, (x - 0.22, y - 0.22, z), -14, 3)
    bowl = [(0, 0.016), (0.05, 0.02), (0.10, 0.05), (0.125, 0.085), (0.13, 0.088), (0.132, 0.085)]
    bowl += [(0.108, 0.045), (0.06, 0.008), (0.045, 0), (0, 0)]
    turquoise = textures.tint((92, 158, 160), 0.06 * textures.noise(rng, (80, 160), 20, 3))
    at = (x + 0.40, y + 0.22, z)
    out.append(round_thing("bowl", _smooth_profile(bowl), at, turquoise))
    balls = ((0.035, 0.01, 0.062), (-0.045, 0.025, 0.06), (-0.005, -0.052, 0.062), (0, 0, 0.105))
    for k, (dx, dy, dz) in enumerate(balls):
        peel = textures.tint((226, 128, 30) if k % 2 else (214, 176, 44), 0.05 * textures.noise(rng, (40, 80), 5, 2))
        fruit = shapes.sphere(0.038 - 0.001 * k, 20).moved(furniture.placed((at[0] + dx, at[1] + dy, at[2] + dz)))
        out.append(Surface("fruit", fruit, peel))
    return out


def _posters(rng: np.random.Generator) -> list[Surface]:
    hung = (  # picture, centre of its back, width, yaw
        (pictures.poster_icp(rng), (-0.20, 1.95, 1.52), 0.98, 0),
        (pictures.poster_mountains(rng), (-1.22, 1.95, 1.55), 0.62, 0),
        (pictures.poster_eye_chart(rng), (0.66, 1.95, 1.50), 0.46, 0),
        (pictures.poster_shapes(rng), (2.6, 1.55, 1.55), 0.62, -90),
        (pictures.poster_clouds(rng), (0.95, 2.75, 1.50), 0.95, 90),
        (pictures.poster_shapes(rng), (-0.6, -2.3, 1.55), 0.7, 180),
        (pictures.poster_clouds(rng), (-1.65, -2.3, 1.5), 0.8, 180),
    )
    return [
        surface
        for picture, at, width, yaw in hung
        for surface in furniture.hanging(rng, textures.framed(picture), at, width, yaw)
    ]


def _smooth_profile(corners: Sequence[Sequence[float]], count: int = 28) -> np.ndarray:
    """A profile through corners, rounded (Chaikin's cutting of corners, twice), evenly spaced; the ends stay."""
    p = np.asarray(corners, float)
    for _ in range(2):
        cut = np.stack([0.75 * p[:-1] + 0.25 * p[1:], 0.25 * p[:-1] + 0.75 * p[1:]], 1).reshape(-1, 2)
        p = np.concatenate([p[:1], cut, p[-1:]])
    way = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(p, axis=0), axis=1))])
    at = np.linspace(0, way[-1], count)
    return np.stack([np.interp(at, way, p[:, k]) for k in (0, 1)], 1)


def desk(seed: int = 0) -> Scene:
    """A desk seen from close by: a keyboard, a cutting mat, a notebook, a mug, books, a carton, a globe and the animal.

    Parameters
    ----------
    seed : decides grain, books and small turns; the places of things stay.

    Returns
    -------
    Scene with the views "first" and "second" (those of the recipe desk_pair) and "overview".
    """
    rng = np.random.default_rng([check_seed(seed), 102])
    top = DESK_TOP
    surfaces = furniture.table(rng, (0, 0, 0), (1.6, 0.8, top), furniture.PINE)
    wall = textures.plaster(rng, textures.shape_of(4.4, 2.4, 0.004), (196, 206, 212), 0.016)
    side = textures.plaster(rng, textures.shape_of(3.4, 2.4, 0.006), (214, 208, 196), 0.016)
    floor = textures.boards(rng, textures.shape_of(4.4, 3.4, 0.004), 0.004, (150, 108, 76))
    surfaces.append(Surface("wall", shapes.rectangle((-2.2, 0.55, 2.4), (4.4, 0, 0), (0, 0, -2.4)), wall))
    surfaces.append(Surface("wall", shapes.rectangle((-2.2, -2.85, 2.4), (0, 3.4, 0), (0, 0, -2.4)), side))
    surfaces.append(Surface("wall", shapes.rectangle((2.2, 0.55, 2.4), (0, -3.4, 0), (0, 0, -2.4)), side))
    surfaces.append(Surface("floor", shapes.rectangle((-2.2, 0.55, 0), (4.4, 0, 0), (0, -3.4, 0)), floor))
    surfaces += furniture.hanging(rng, textures.framed(pictures.poster_icp(rng)), (-0.30, 0.55, 1.17), 0.62)
    surfaces += furniture.hanging(rng, textures.framed(pictures.poster_mountains(rng)), (0.34, 0.55, 1.2), 0.40)
    mat, green = {"top": pictures.cutting_mat(rng, 640, 940)}, painted((40, 104, 84))
    surfaces += block(rng, "mat", (0.47, 0.32, 0.003), (0.06, -0.16, top), 3, green, mat, detail=2)
    keys = {"top": pictures.keyboard(280, 800)}
    surfaces += block(rng, "keyboard", (0.36, 0.125, 0.018), (-0.44, -0.21, top), 9, painted((44, 46, 52)), keys)
    page = {"top": pictures.notebook_page(rng, 600, 430)}
    surfaces += block(rng, "notebook", (0.15, 0.21, 0.012), (0.42, -0.17, top), -13, painted((236, 232, 222)), page)
    scale = {"top": pictures.ruler(46, 1200)}
    steel = painted((190, 192, 194))
    surfaces += block(rng, "ruler", (0.31, 0.03, 0.0015), (0.03, -0.24, top + 0.003), 14, steel, scale)
    surfaces += furniture.printed_box(rng, (-0.30, 0.12, top), 16, (0.22, 0.15, 0.17))
    surfaces += books.lying_books(rng, (0.42, 0.14, top), -8, 4)
    surfaces += furniture.mug(rng, (-0.08, 0.00, top), (46, 110, 140), yaw=-35)
    surfaces += furniture.animal(seed, (0.12, 0.02, top + 0.003), -108, 1.15, 0.0026)
    ball = shapes.sphere(0.075, 52).moved(furniture.placed((0.23, 0.27, top + 0.09), 40))
    surfaces.append(Surface("globe", ball, pictures.globe(rng)))
    stand = [(0.02, 0.022), (0.04, 0.012), (0.045, 0), (0, 0)]
    surfaces.append(round_thing("globe", stand, (0.23, 0.27, top), textures.plain(rng, (12, 24), (60, 48, 40))))
    surfaces += _pencils(rng, (-0.06, 0.24, top))
    lights = [
        window_light((-1.9, -1.4, 1.0), (0, 1.4, 0), (0, 0, 1.2), np.multiply((0.93, 1.0, 1.1), 3.2)),
        bulb_light((0.7, -0.4, 1.9), 0.16, np.multiply((1.0, 0.86, 0.68), 1.1)),
    ]
    views = {
        "first": look_at((-0.16, -0.68, 1.24), (0.0, 0.04, 0.79)),
        "second": look_at((-0.07, -0.66, 1.27), (0.03, 0.05, 0.79)),
        "overview": look_at((0.9, -1.5, 1.75), (0.0, 0.1, 0.8)),
    }
    return Scene(surfaces, lights, (0.34, 0.33, 0.32), views)


def _pencils(rng: np.random.Generator, at: Sequence[float]) -> list[Surface]:
    cup = shapes.sharp([(0, 0.01), (0.034, 0.01), (0.034, 0.10), (0.038, 0.10), (0.038, 0), (0, 0)])
    out = [round_thing("pencils", cup, at, textures.wood(rng, (60, 160), (150, 96, 62)))]
    for k in range(6):
        turn, lean = 2 * np.pi * k / 6 + rng.uniform(-0.3, 0.3), rng.uniform(0.10, 0.24)
        pencil = [(0, 0.175), (0.0035, 0.158), (0.0037, 0.155), (0.0037, 0), (0, 0)]
        paint = np.empty((60, 8, 3), np.uint8)
        paint[:] = np.asarray(pictures.INKS[k], np.uint8)
        paint[:6], paint[:2] = (226, 190, 140), (40, 40, 40)
        axis = np.array([np.sin(lean) * np.cos(turn), np.sin(lean) * np.sin(turn), np.cos(lean)])
        side = np.cross((0, 1.0, 0), axis)
        side /= np.linalg.norm(side)
        T = np.eye(4)
        T[:3, 0], T[:3, 1], T[:3, 2] = side, np.cross(axis, side), axis
        T[:3, 3] = np.asarray(at) + (0.014 * np.cos(turn), 0.014 * np.sin(turn), 0.012)
        out.append(Surface("pencils", shapes.turned(shapes.sharp(pencil), 12).moved(T), paint))
    return out
