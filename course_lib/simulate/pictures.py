"""Things with a picture on them: posters, book spines, a printed box, a globe, a keyboard, a mat, a window."""

from __future__ import annotations

import cv2
import numpy as np

from course_lib.simulate.textures import INK, PAPER, Colour, noise, speckled, tint, write

INKS = ((196, 61, 48), (38, 84, 124), (236, 164, 52), (54, 117, 88), (110, 69, 121), (24, 120, 140), (201, 104, 62))


def poster_mountains(rng: np.random.Generator, h: int = 620, w: int = 440) -> np.ndarray:
    """Ridges behind ridges under a low sun: distance shown by haze."""
    sky = np.linspace(0, 1, h, dtype=np.float32)[:, None, None]
    picture = ((1 - sky) * (64, 92, 140) + sky * 1.35 * (246, 190, 130)).clip(0, 255) * np.ones((1, w, 1), np.float32)
    picture = picture.astype(np.uint8)
    cv2.circle(picture, (int(0.66 * w), int(0.33 * h)), int(0.13 * w), (255, 236, 190), -1, cv2.LINE_AA)
    far, near = np.array((196, 164, 160), float), np.array((24, 40, 52), float)
    for k in range(6):
        line = noise(rng, (1, w), w / (2.2 + 0.7 * k), 6)[0]
        line = (line - line.mean()) / (np.abs(line).max() + 1e-6)
        top = h * (0.42 + 0.085 * k) - line * h * (0.10 - 0.008 * k)
        colour = far + (near - far) * (k / 5) ** 0.8
        inside = np.arange(h)[:, None] > top[None]
        haze = np.clip((np.arange(h)[:, None] - top[None]) / (0.5 * h), 0, 0.5)[..., None]
        layer = colour * (1 - 0.5 * haze) + far * 0.5 * haze
        picture = np.where(inside[..., None], layer, picture)
    picture = np.ascontiguousarray(picture.clip(0, 255).astype(np.uint8))
    write(picture, "DEPTH", (w / 2, 0.11 * h), 0.12 * h, (250, 244, 232), thickness=0.2, fit=0.78 * w)
    write(picture, "is what photographs forget", (w / 2, 0.205 * h), 0.03 * h, (250, 244, 232), fit=0.78 * w)
    return speckled(rng, picture)


def poster_eye_chart(rng: np.random.Generator, h: int = 620, w: int = 440) -> np.ndarray:
    """Lines of letters that shrink: how far a camera resolves."""
    picture = np.empty((h, w, 3), np.uint8)
    picture[:] = PAPER
    y, size = 0.12 * h, 0.15 * h
    for count in (1, 2, 3, 4, 6, 8, 9, 10):
        letters = rng.choice(list("ACDEFHKLNOPRSTVXYZ"), count)
        for k, letter in enumerate(letters):
            x = w * (k + 1) / (count + 1) if count < 6 else w * (0.12 + 0.76 * k / (count - 1))
            write(picture, str(letter), (x, y), size, INK, thickness=0.16)
        below = int(y + 0.75 * size)
        cv2.line(picture, (int(0.08 * w), below), (int(0.92 * w), below), (196, 61, 48), 1)
        y, size = y + 1.5 * size, size * 0.72
    return speckled(rng, picture)


def poster_shapes(rng: np.random.Generator, h: int = 620, w: int = 440) -> np.ndarray:
    """Overlapping discs, bars and a grid of dots, in the manner of the 1920s."""
    picture = np.empty((h, w, 3), np.uint8)
    picture[:] = (238, 228, 206)
    cv2.circle(picture, (int(0.42 * w), int(0.36 * h)), int(0.30 * w), INKS[0], -1, cv2.LINE_AA)
    cv2.rectangle(picture, (int(0.52 * w), int(0.12 * h)), (int(0.80 * w), int(0.60 * h)), INKS[1], -1)
    half = (int(0.19 * w),) * 2
    cv2.ellipse(picture, (int(0.52 * w), int(0.36 * h)), half, 0, -90, 90, INKS[2], -1, cv2.LINE_AA)
    triangle = np.array([[0.12 * w, 0.74 * h], [0.46 * w, 0.50 * h], [0.60 * w, 0.76 * h]], np.int32)
    cv2.fillPoly(picture, [triangle], INK, cv2.LINE_AA)
    for k in range(7):
        for j in range(5):
            spot = (int((0.64 + 0.05 * k) * w), int((0.66 + 0.028 * j) * h))
            cv2.circle(picture, spot, max(2, int(0.009 * w)), INK if (k + j) % 2 else INKS[0], -1, cv2.LINE_AA)
    for k in range(4):
        y = int((0.08 + 0.017 * k) * h)
        cv2.line(picture, (int(0.1 * w), y), (int(0.44 * w), y), INK, 3)
    write(picture, "RIGID", (0.5 * w, 0.845 * h), 0.085 * h, INK, thickness=0.2, fit=0.8 * w)
    write(picture, "six numbers move the world", (0.5 * w, 0.935 * h), 0.024 * h, INK, fit=0.8 * w)
    return speckled(rng, picture)


def poster_icp(rng: np.random.Generator, h: int = 440, w: int = 620) -> np.ndarray:
    """Two curves of dots that almost fit, each dot tied to its nearest neighbour."""
    picture = np.empty((h, w, 3), np.uint8)
    picture[:] = (22, 36, 54)
    s = np.linspace(0, 2 * np.pi, 46)
    radius = 0.27 * h * (1 + 0.28 * np.cos(3 * s) + 0.10 * np.sin(5 * s))
    first = np.stack([0.70 * w + radius * np.cos(s), 0.52 * h + radius * np.sin(s)], 1)
    c, d = np.cos(0.30), np.sin(0.30)
    second = (first - first.mean(0)) @ np.array([[c, d], [-d, c]]) + first.mean(0) + (-0.045 * w, -0.03 * h)
    for p in second:
        q = first[np.argmin(np.sum((first - p) ** 2, 1))]
        cv2.line(picture, tuple(map(int, p)), tuple(map(int, q)), (150, 160, 172), 1, cv2.LINE_AA)
    for cloud, colour in ((first, (240, 174, 60)), (second, (86, 180, 233))):
        for p in cloud:
            cv2.circle(picture, tuple(map(int, p)), max(3, w // 150), colour, -1, cv2.LINE_AA)
    write(picture, "ICP", (0.25 * w, 0.38 * h), 0.40 * h, (244, 240, 230), thickness=0.2, fit=0.40 * w)
    for k, text in enumerate(("match,", "move,", "repeat")):
        write(picture, text, (0.25 * w, (0.62 + 0.12 * k) * h), 0.085 * h, (240, 174, 60), thickness=0.14)
    return speckled(rng, picture)


def poster_clouds(rng: np.random.Generator, h: int = 440, w: int = 620) -> np.ndarray:
    """An abstract of bright blots, rich in detail."""
    levels = noise(rng, (h, w), 90, 5)
    wheel = [(28, 48, 78), (40, 108, 126), (112, 168, 140), (236, 214, 160), (222, 128, 74), (160, 50, 52)]
    wheel = np.array(wheel, float)
    at = np.clip((levels - levels.min()) / (np.ptp(levels) + 1e-6) * 5, 0, 4.999)
    low = at.astype(int)
    picture = wheel[low] + (wheel[low + 1] - wheel[low]) * (at - low)[..., None]
    picture[(np.abs(at - np.rint(at)) < 0.035)] *= 0.72
    return speckled(rng, picture.astype(np.uint8))


def printed_box(
    h: int, w: int, lines: tuple[str, ...], colour: Colour = (30, 30, 33), ink: Colour = (246, 246, 242)
) -> np.ndarray:
    """A carton with lines of text, the first one largest: white on black unless said otherwise."""
    picture = np.empty((h, w, 3), np.uint8)
    picture[:] = np.asarray(colour, np.uint8)
    band = max(2, h // 60)
    cv2.rectangle(picture, (3 * band, 3 * band), (w - 3 * band, h - 3 * band), tuple(map(int, ink)), band)
    share = np.array([1.6, *[1.0] * (len(lines) - 1)])
    middle = (np.cumsum(share) - share / 2) / share.sum()
    for text, y, part in zip(lines, middle, share, strict=True):
        tall = 0.5 * h * part / share.sum()
        write(picture, text, (w / 2, h * (0.12 + 0.76 * y)), tall, ink, thickness=0.18, fit=0.74 * w)
    return picture


def spine(rng: np.random.Generator, h: int, w: int, title: str, colour: Colour) -> np.ndarray:
    """The back of a book, ``h`` tall and ``w`` wide, its title running from top to bottom."""
    lying = np.empty((w, h, 3), np.uint8)
    lying[:] = np.asarray(colour, np.uint8)
    ink = (246, 238, 214) if np.mean(colour) < 150 else INK
    for x in (0.06, 0.085, 0.915, 0.94):
        cv2.line(lying, (int(x * h), 0), (int(x * h), w), ink, max(1, h // 160))
    write(lying, title, (0.5 * h, 0.5 * w), min(0.5 * w, 0.10 * h), ink, thickness=0.14, fit=0.74 * h)
    return speckled(rng, np.ascontiguousarray(np.rot90(lying, -1)), 0.03)


def globe(rng: np.random.Generator, h: int = 360, w: int = 720) -> np.ndarray:
    """A world map of no known world: seas, land with mountains, ice, and the grid of latitude and longitude."""
    turn = np.linspace(0, 2 * np.pi, w, endpoint=False)[None]
    lat = np.linspace(np.pi / 2, -np.pi / 2, h)[:, None]
    p = np.stack([np.cos(lat) * np.cos(turn), np.cos(lat) * np.sin(turn), np.sin(lat) * np.ones_like(turn)], -1)
    height = np.zeros((h, w))
    for k in range(26):  # waves in space have no seam
        direction = rng.normal(size=3)
        direction *= (1.6 + 0.42 * k) / np.linalg.norm(direction)
        height += np.sin(sum(p[..., i] * direction[i] for i in range(3)) * 1.7 + rng.uniform(0, 6.28)) / (1 + 0.22 * k)
    height -= np.quantile(height, 0.60)
    land = height > 0
    tall = np.clip(height / height.max(), 0, 1)[..., None]
    ground = np.array((104, 150, 84)) * (1 - tall) + np.array((196, 164, 110)) * tall
    sea = np.array((40, 92, 150)) * (1 - 0.35 * np.clip(-height / 2.5, 0, 1)[..., None])
    picture = np.where(land[..., None], ground, sea)
    ice = (np.abs(lat) > 1.22 + 0.1 * np.sin(5 * turn)) | (tall[..., 0] > 0.8)
    picture = np.where(ice[..., None], 236.0, picture)
    picture = np.ascontiguousarray(picture.astype(np.uint8))
    for k in range(12):
        cv2.line(picture, (k * w // 12, 0), (k * w // 12, h), (230, 232, 226), 2)
    for k in range(1, 6):
        cv2.line(picture, (0, k * h // 6), (w, k * h // 6), (230, 232, 226), 2 if k != 3 else 4)
    return picture


def view_outside(rng: np.random.Generator, h: int = 300, w: int = 420) -> np.ndarray:
    """What a window shows, over-exposed as a camera indoors sees it."""
    sky = np.linspace(0, 1, h, dtype=np.float32)[:, None, None]
    picture = np.ones((1, w, 1), np.float32) * ((1 - sky) * (206, 226, 250) + sky * (250, 250, 244))
    hills = h * 0.72 + 0.06 * h * noise(rng, (1, w), w / 4, 4)[0]
    picture = np.where((np.arange(h)[:, None] > hills[None])[..., None], (196, 214, 186), picture)
    return picture.clip(0, 255).astype(np.uint8)


def keyboard(h: int, w: int) -> np.ndarray:
    """Five rows of keys with letters."""
    picture = np.empty((h, w, 3), np.uint8)
    picture[:] = (44, 46, 52)
    rows = ("1234567890-=<", "QWERTYUIOP[]#", "ASDFGHJKL;'@+", "ZXCVBNM,./^*!")
    key = w / 13.6
    for r, letters in enumerate(rows):
        for k, letter in enumerate(letters):
            x, y = (0.3 + k + (0.0, 0.08, 0.14, 0.2)[r]) * key, (0.25 + 1.02 * r) * h / 5.4
            _key(picture, x, y, 0.9 * key, 0.86 * h / 5.4)
            write(picture, letter, (x + 0.42 * key, y + 0.4 * h / 5.4), 0.30 * h / 5.4, (236, 236, 232), thickness=0.1)
    y = 4.33 * h / 5.4
    for x, width in ((0.3, 1.4), (1.8, 1.2), (3.1, 6.2), (9.4, 1.2), (10.7, 2.5)):
        _key(picture, x * key, y, (width - 0.1) * key, 0.86 * h / 5.4)
    return picture


def _key(picture: np.ndarray, x: float, y: float, w: float, h: float) -> None:
    a, b = (round(x), round(y)), (round(x + w), round(y + h))
    cv2.rectangle(picture, a, b, (84, 88, 96), -1)
    cv2.rectangle(picture, a, b, (28, 29, 33), max(1, round(h / 22)))


def cutting_mat(rng: np.random.Generator, h: int, w: int, cells: tuple[int, int] = (30, 45)) -> np.ndarray:
    """A green mat ruled in centimetres, numbered every five."""
    picture = tint((40, 104, 84), 0.03 * noise(rng, (h, w), 5, 2))
    light = (198, 222, 196)
    dy, dx = h / (cells[0] + 2), w / (cells[1] + 2)
    for k in range(cells[1] + 1):
        x = round((k + 1) * dx)
        cv2.line(picture, (x, round(dy)), (x, round(h - dy)), light, 2 if k % 5 == 0 else 1)
        if k % 5 == 0:
            write(picture, str(k), (x, 0.5 * dy), 0.5 * dy, light)
    for k in range(cells[0] + 1):
        y = round((k + 1) * dy)
        cv2.line(picture, (round(dx), y), (round(w - dx), y), light, 2 if k % 5 == 0 else 1)
    cv2.line(picture, (round(dx), round(h - dy)), (round(w - dx), round(dy)), light, 1, cv2.LINE_AA)
    return picture


def notebook_page(rng: np.random.Generator, h: int, w: int) -> np.ndarray:
    """A squared page with formulas and a sketch of a camera, as if by hand."""
    picture = tint((247, 245, 238), 0.008 * noise(rng, (h, w), 20, 2))
    for k in range(1, 28):
        cv2.line(picture, (0, k * h // 28), (w, k * h // 28), (206, 220, 232), 1)
        cv2.line(picture, (k * h // 28, 0), (k * h // 28, h), (206, 220, 232), 1)
    blue, font = (36, 52, 128), cv2.FONT_HERSHEY_SCRIPT_SIMPLEX
    for k, text in enumerate(("z = f B / d", "u = f x / z + c", "p' = R p + t", "depth is z,", "not range!")):
        write(picture, text, (0.45 * w, (0.09 + 0.1 * k) * h), 0.06 * h, blue, font=font, fit=0.8 * w)
    tip, left, right = (int(0.22 * w), int(0.76 * h)), (int(0.80 * w), int(0.62 * h)), (int(0.80 * w), int(0.90 * h))
    for a, b in ((tip, left), (tip, right), (left, right)):
        cv2.line(picture, a, b, blue, max(1, w // 180), cv2.LINE_AA)
    cv2.circle(picture, (int(0.66 * w), int(0.75 * h)), int(0.04 * w), (196, 61, 48), max(1, w // 150), cv2.LINE_AA)
    return picture


def ruler(h: int, w: int, centimetres: int = 30) -> np.ndarray:
    """A steel ruler with millimetre marks."""
    picture = np.full((h, w, 3), (204, 206, 206), np.uint8)
    for k in range(10 * centimetres + 1):
        x = round(w * (0.02 + 0.96 * k / (10 * centimetres)))
        cv2.line(picture, (x, 0), (x, round(h * (0.42 if k % 10 == 0 else 0.30 if k % 5 == 0 else 0.20))), INK, 1)
        if k % 10 == 0 and k < 10 * centimetres:
            write(picture, str(k // 10), (x + 0.012 * w, 0.62 * h), 0.26 * h, INK)
    return picture
