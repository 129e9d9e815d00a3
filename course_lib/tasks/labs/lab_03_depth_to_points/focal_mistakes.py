"""The wrong answers of lab 03's task 1, as learner code: one mistake, or two at once."""

from __future__ import annotations

from course_lib.tasks.core import Misconception


def _wrong_focal(expression: str) -> str:
    return f"def focal_length(fov_degrees, pixels):\n    return {expression}\n"


_ANGLES = {
    "whole for half angle": (
        "np.radians(fov_degrees)",
        "the tangent of the whole angle: the triangle has half the image on one side, so halve the angle too",
    ),
    "degrees for radians": (
        "fov_degrees / 2",
        "degrees given to a tangent that expects radians: convert with np.radians first",
    ),
    "degrees, whole angle": (
        "fov_degrees",
        "the whole angle, in degrees, given to a tangent that expects radians: halve it and convert with np.radians",
    ),
    "np.degrees used": (
        "np.degrees(fov_degrees / 2)",
        "np.degrees where np.radians belongs: the angle comes in degrees, and the tangent expects radians",
    ),
    "angle doubled": (
        "np.radians(fov_degrees) * 2",
        "twice the angle: the triangle has half of it, so divide by 2",
    ),
    "angle cut": (
        "np.radians(fov_degrees // 2)",
        "half the angle cut to whole degrees: divide with /, not //",
    ),
    "angle in gradians": (
        "fov_degrees / 2 * np.pi / 200",
        "200 for half a turn, as gradians have it: half a turn is 180 degrees, np.radians knows it",
    ),
    "angle halved twice": (
        "np.radians(fov_degrees) / 4",
        "a quarter of the angle: halve it once",
    ),
}
_SIZES = {
    "whole for half image": (
        "pixels",
        "the whole image over the tangent of half the angle, twice too long: halve the number of pixels as well",
    ),
    "pixels less one": (
        "0.5 * (pixels - 1)",
        "one pixel too few: the angle spans all of them, from edge to edge",
    ),
    "640 taken for granted": (
        "320",
        "half of 640 whatever is given: the images differ in size, use pixels",
    ),
}
_FUNCTIONS = {
    "tangent upside down": (
        "{s} * np.tan({a})",
        "a product with the tangent where a quotient belongs: at 90 degrees the tangent of the half is 1 and hides it",
    ),
    "sine for tangent": (
        "{s} / np.sin({a})",
        "a sine where the tangent belongs: f is the side next to the angle, not the longest one",
    ),
    "cosine for tangent": (
        "{s} / np.cos({a})",
        "a cosine where the tangent belongs: half the image stands opposite the angle, f beside it",
    ),
    "arctangent for tangent": (
        "{s} / np.arctan({a})",
        "an arctangent where the tangent belongs: you have the angle and want the ratio of two sides",
    ),
    "angle for its tangent": (
        "{s} / ({a})",
        "the angle itself where its tangent belongs: they are alike for small angles only",
    ),
    "tangent squared": (
        "{s} / np.tan({a}) ** 2",
        "the tangent squared: the quotient holds it once",
    ),
    "tangent's side swapped": (
        "np.tan({a}) / ({s})",
        "the quotient upside down: f is half the pixels over the tangent",
    ),
}
_TWICE = ("whole for half angle", "whole for half image")  # is "tangent halved"
_SOME = ("tangent upside down", "sine for tangent", "angle for its tangent")
_RIGHT_FOCAL = ("np.radians(fov_degrees) / 2", "0.5 * pixels", "{s} / np.tan({a})")


def _focal_with(angle: str = "", size: str = "", function: str = "") -> Misconception:
    """One mistake, or two at once, in the angle, the size of the image and the function."""
    parts = ((angle, _ANGLES), (size, _SIZES), (function, _FUNCTIONS))
    a, s, f = (known[name][0] if name else right for (name, known), right in zip(parts, _RIGHT_FOCAL, strict=True))
    made = [(name, known[name][1]) for name, known in parts if name]
    return Misconception(
        " and ".join(name for name, _ in made),
        "; and ".join(message for _, message in made),
        _wrong_focal(f.format(a=a, s=s)),
    )


FOCAL_MISTAKES = (
    *(_focal_with(angle=name) for name in _ANGLES),
    *(_focal_with(size=name) for name in _SIZES),
    *(_focal_with(function=name) for name in _FUNCTIONS),
    *(_focal_with(angle, size) for angle in _ANGLES for size in _SIZES if (angle, size) != _TWICE),
    *(_focal_with(angle, function=name) for angle in ("whole for half angle", "degrees for radians") for name in _SOME),
    *(_focal_with(size="whole for half image", function=name) for name in _SOME),
    Misconception(
        "angle in proportion",
        "half the angle taken for twice the focal length: a tangent does not grow in proportion, so use np.tan",
        _wrong_focal("0.5 * pixels * 90 / fov_degrees"),
        variants=(_wrong_focal("320 * 90 / fov_degrees"),),
    ),
    Misconception(
        "tangent halved",
        "half of the tangent where the tangent of half the angle belongs: halve the angle before np.tan",
        _wrong_focal("0.5 * pixels / (np.tan(np.radians(fov_degrees)) / 2)"),
    ),
)
