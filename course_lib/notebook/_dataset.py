"""What `data.load` returns: frames, clouds, poses and truth, decoded when they are asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from course_lib.camera.pinhole import PinholeCamera
from course_lib.camera.rgbd import DepthEncoding, RGBDFrame, decode_depth
from course_lib.cloud.pointcloud import PointCloud
from course_lib.notebook._catalog import Entry
from course_lib.notebook._errors import NotHere, Refusal, nearest
from course_lib.notebook._images import read_depth, read_image
from course_lib.surface.meshes import Mesh


class Lazy(Sequence):
    """A sequence whose items are made anew each time they are asked for: changing one changes no other's copy."""

    def __init__(self, count: int, make: Callable[[int], Any], what: str):
        self._count, self._make, self._what = count, make, what

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, index: int | slice) -> Any:
        if isinstance(index, slice):
            return [self._make(i) for i in range(*index.indices(self._count))]
        if not isinstance(index, (int, np.integer)) or isinstance(index, bool):
            raise Refusal(f"Choose one of the {self._what} by a whole number or a slice, not by {index!r}.")
        if not -self._count <= index < self._count:
            raise _NoSuchItem(f"There are {self._count} {self._what}, numbered from 0: {index} is not one of them.")
        return self._make(int(index) % self._count)

    def __repr__(self) -> str:
        what = self._what.removesuffix("s") if self._count == 1 else self._what
        return f"{self._count} {what}, decoded when asked for"


class _NoSuchItem(Refusal, IndexError):
    """Ends a loop over a sequence, and shows as one sentence."""


class Parts(Mapping):
    """A read-only dict whose values are made when first asked for; a wrong key suggests the nearest."""

    def __init__(self, makers: Mapping[str, Callable[[], Any]], what: str):
        self._makers, self._what, self._made = dict(makers), what, {}

    def __getitem__(self, key: str) -> Any:
        if key not in self._makers:
            suggestion = nearest(str(key), self._makers) or f" It has {', '.join(self._makers)}."
            raise _NoSuchKey(f"{self._what} has no {key!r}.{suggestion}")
        if key not in self._made:
            self._made[key] = self._makers[key]()
        return self._made[key]

    def __contains__(self, key: object) -> bool:
        return key in self._makers

    def __iter__(self) -> Iterator[str]:
        return iter(self._makers)

    def __len__(self) -> int:
        return len(self._makers)

    def __repr__(self) -> str:
        return f"{self._what}: {', '.join(self._makers) or 'nothing'}"


class _NoSuchKey(Refusal, KeyError):
    """A missing key that shows as one sentence."""

    __str__ = ValueError.__str__


def _held(part: str, words: str) -> Any:
    """A property that gives a part of a dataset, or refuses in these words where it is not there."""
    return property(lambda dataset: dataset._part(part, words))


@dataclass(frozen=True, repr=False, eq=False)
class Dataset:
    """A dataset: whatever it holds, in the course's types and units. Asking for what it lacks raises one sentence.

    Attributes
    ----------
    name, title, credit, licence : texts.
    kind : "synthetic" (made here, with truth), "real" (captured) or "yours".
    card : the text of datasets/NAME.md: what it is, what it is good for, what to watch out for.
    units : what lengths are given in.
    frames : sequence of RGBDFrame, metres, decoded when asked for.
    encoding : how the depth of `raw` is stored.
    camera : intrinsics; `camera.source` says where they come from, or "assumed".
    poses : list of (4, 4) T_world_camera, one a frame, None where a recording lacks it. Truth only in a synthetic
        dataset.
    cloud, clouds : the main PointCloud, and all by name.
    mesh, meshes : the main Mesh, and all by name.
    truth : by name, what is known exactly; synthetic datasets only.
    reference : by name, what another method or instrument says; not truth.
    parts : by name, datasets of their own inside this one (another camera, another encoding).
    files : name → path, as stored.
    meta : facts by name.
    """

    name: str
    kind: Literal["synthetic", "real", "yours"]
    title: str
    card: str = ""
    credit: str = ""
    licence: str = ""
    units: str = "metres"
    meta: Mapping[str, Any] = field(default_factory=dict)
    files: Mapping[str, Path] = field(default_factory=dict)
    held: Mapping[str, Any] = field(default_factory=dict)
    raw_frame: Callable[[int], tuple[np.ndarray, np.ndarray]] | None = None

    def _part(self, part: str, words: str) -> Any:
        has = self._has()
        if part not in has:
            raise NotHere(f"The dataset {self.name} has no {words}; it has {', '.join(has) or 'files only'}.")
        return has[part]

    def _has(self) -> dict[str, Any]:
        """What it holds, without the parts that are empty."""
        return {
            name: value
            for name, value in self.held.items()
            if value is not None and not (isinstance(value, (Parts, Lazy)) and not len(value))
        }

    frames = _held("frames", "frames")
    encoding = _held("encoding", "depth images, so no encoding")
    camera = _held("camera", "camera")
    poses = _held("poses", "poses")
    clouds = _held("clouds", "clouds")
    meshes = _held("meshes", "meshes")
    reference = _held("reference", "reference from another method")
    parts = _held("parts", "parts")

    @property
    def cloud(self) -> PointCloud:
        clouds = self.clouds
        return clouds["cloud"] if "cloud" in clouds else clouds[next(iter(clouds))]

    @property
    def mesh(self) -> Mesh:
        meshes = self.meshes
        return meshes["surface"] if "surface" in meshes else meshes[next(iter(meshes))]

    @property
    def truth(self) -> Mapping[str, Any]:
        if self.kind != "synthetic":
            raise NotHere(f"The dataset {self.name} was captured, so its truth is unknown: see its reference and card.")
        return self._part("truth", "truth")

    def raw(self, index: int) -> tuple[np.ndarray, np.ndarray]:
        """Return colour (H, W, 3) uint8 RGB and depth (H, W) uint16 of a frame exactly as they are stored."""
        frames = self.frames
        if self.raw_frame is None or not -len(frames) <= index < len(frames):
            raise _NoSuchItem(f"{self.name} has {len(frames)} frames, numbered from 0: {index} is not one of them.")
        return self.raw_frame(int(index) % len(frames))

    def __repr__(self) -> str:
        kinds = {"synthetic": "made here, with truth", "real": "recorded by others", "yours": "your own recording"}
        lines = [f"{self.name}: {self.title}", f"  kind        {self.kind} ({kinds[self.kind]}); units: {self.units}"]
        lines += [f"  {name:<11} {_brief(value)}" for name, value in self._has().items()]
        lines += [f"  {name:<11} {text}" for name, text in (("licence", self.licence), ("credit", self.credit)) if text]
        return "\n".join(lines)


def described(entry: Entry, meta: Mapping[str, Any], files: Mapping[str, Path]) -> Dataset:
    """A dataset of the catalogue as its entry and its card tell of it, holding nothing yet."""
    card = entry.card_path.read_text(encoding="utf-8") if entry.card_path.exists() else ""
    meta = {"citation": entry.citation, **meta} if entry.citation else meta
    return Dataset(entry.name, entry.kind, entry.title, card, entry.credit, entry.licence, entry.units, meta, files)


def with_frames(
    base: Dataset,
    names: Sequence[str],
    raw: Callable[[int], tuple[np.ndarray, np.ndarray]],
    encoding: DepthEncoding | None,
    camera: PinholeCamera | None,
    *,
    poses: Sequence[np.ndarray] | None = None,
    registered: bool = True,
    **held: Any,
) -> Dataset:
    """Add frames to a dataset, each decoded when asked for, and whatever else it holds.

    Parameters
    ----------
    names : one a frame.
    raw : gives colour and depth of a frame as they are stored; see `Dataset.raw`.
    encoding, camera, registered : of all frames; None where there are none.
    poses : (4, 4) T_world_camera, one a frame, or None.
    """

    def frame(index: int) -> RGBDFrame:
        color, depth = raw(index)
        T = None if poses is None else poses[index]
        return RGBDFrame(color, decode_depth(depth, encoding), camera, T, registered=registered, name=names[index])

    parts = {
        "frames": Lazy(len(names), frame, "frames"),
        "encoding": encoding,
        "camera": camera,
        "poses": None if poses is None else list(poses),
    }
    return replace(base, held={**parts, **held}, raw_frame=raw)


def raw_of(pairs: Sequence[tuple[Path, Path]]) -> Callable[[int], tuple[np.ndarray, np.ndarray]]:
    """Give colour and depth of a frame as they are stored, from pairs of such files; see `Dataset.raw`."""
    return lambda index: (read_image(pairs[index][0]), read_depth(pairs[index][1]))


def _brief(value: Any) -> str:
    """Say in a few words what a part is."""
    if isinstance(value, Lazy):
        return repr(value)
    if isinstance(value, Parts):
        return ", ".join(value)
    if isinstance(value, PinholeCamera):
        numbers = ", ".join(f"{name} {getattr(value, name):.1f}" for name in ("fx", "fy", "cx", "cy"))
        return f"{value.width}x{value.height}, {numbers}; {value.source or 'source not given'}"
    if isinstance(value, DepthEncoding):
        no_data = " and ".join(str(number) for number in value.no_data)
        return f"{value.name}: {value.units_per_metre:g} units a metre, {no_data} = no data"
    if isinstance(value, list):
        known = sum(T is not None for T in value)
        return f"{known if known == len(value) else f'{known} of {len(value)}'} T_world_camera"
    return str(value)
