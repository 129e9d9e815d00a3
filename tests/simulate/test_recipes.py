from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from course_lib.camera.pinhole import PinholeCamera, deproject
from course_lib.camera.rgbd import ENCODINGS, decode_depth
from course_lib.geometry.transforms import apply, check_rigid, compose
from course_lib.simulate import d455
from course_lib.simulate.recipes.living_room import living_room_path
from course_lib.simulate.recipes.recipe import RecipeOutput, recipe
from course_lib.simulate.trajectories import path_length

ROOT = Path(__file__).parents[2]
FINGERPRINT = """
import hashlib, sys
import cv2, numpy as np, open3d as o3d
threads = int(sys.argv[2])
o3d.utility.set_max_threads(threads)
cv2.setNumThreads(threads)
from course_lib.simulate.recipes.recipe import recipe
output, digest = recipe(sys.argv[1]).make(), hashlib.sha256()
for arrays in [*output.frames, *output.meshes.values(), *output.clouds.values(), output.truth, {"poses": output.poses}]:
    for name in sorted(arrays):
        digest.update(name.encode() + np.ascontiguousarray(arrays[name]).tobytes())
print(digest.hexdigest())
"""


@pytest.fixture(scope="module")
def pair() -> RecipeOutput:
    steps: list[tuple[int, int]] = []
    output = recipe("desk_pair").make(progress=lambda done, total: steps.append((done, total)))
    assert steps[0][0] == 0 and steps[-1][0] == steps[-1][1]
    assert all(a[0] <= b[0] and a[1] == b[1] for a, b in zip(steps[:-1], steps[1:], strict=True))
    return output


@pytest.fixture(scope="module")
def bunny() -> RecipeOutput:
    return recipe("bunny_like").make()


def check_form(output: RecipeOutput) -> None:
    """Whatever stores datasets relies on this form."""
    count = len(output.frames)
    assert output.poses.shape == (count, 4, 4) and output.poses.dtype == np.float64
    json.dumps(output.meta)
    assert {"title", "label_names"} <= set(output.meta)
    if count:
        camera, size = PinholeCamera(**output.camera), (output.camera["height"], output.camera["width"])
        assert output.encoding in ENCODINGS and size == (camera.height, camera.width)
    form = {"color": np.uint8, "depth_raw": np.uint16, "depth_truth": np.float32}
    form |= {"labels": np.uint8, "artefacts": np.uint8}
    for frame, T in zip(output.frames, output.poses, strict=True):
        check_rigid(T)
        assert {name: array.dtype for name, array in frame.items()} == form
        assert all(array.shape[:2] == size for array in frame.values())
        assert frame["labels"].max() < len(output.meta["label_names"])
        assert frame["artefacts"].max() < len(output.meta["artefact_names"])
    for mesh in output.meshes.values():
        assert mesh["vertices"].dtype == np.float32 and mesh["triangles"].dtype == np.int32
        assert mesh["triangles"].max() < len(mesh["vertices"])
    for arrays in [*output.meshes.values(), *output.clouds.values()]:
        points = arrays["vertices" if "vertices" in arrays else "points"]
        for name, dtype in (("colors", np.uint8), ("normals", np.float32), ("labels", np.uint8)):
            assert name not in arrays or (arrays[name].dtype == dtype and len(arrays[name]) == len(points))
    assert all(isinstance(array, np.ndarray) for array in output.truth.values())


@pytest.mark.slow
def test_recipes_have_the_promised_form(pair, bunny):
    check_form(pair)
    check_form(bunny)


@pytest.mark.slow
def test_bunny_like_has_about_the_size_of_the_bunny(bunny):
    cloud, mesh = bunny.clouds["cloud"], bunny.meshes["surface"]
    assert 35_000 < len(cloud["points"]) < 37_500
    assert np.array_equal(cloud["points"], mesh["vertices"])
    assert np.allclose(np.linalg.norm(cloud["normals"], axis=1), 1, atol=1e-5)
    assert cloud["labels"].min() == 1 and cloud["labels"].max() == len(bunny.meta["label_names"]) - 1
    assert cloud["colors"].std(axis=0).min() > 20


@pytest.mark.slow
def test_desk_pair_depth_agrees_with_its_truth(pair):
    camera = PinholeCamera(**pair.camera)
    for frame in pair.frames:
        depth = decode_depth(frame["depth_raw"], pair.encoding)
        clean = (frame["artefacts"] == d455.MEASURED) & (depth > 0)
        error = (depth - frame["depth_truth"])[clean] / d455.depth_sigma(frame["depth_truth"][clean], camera)
        assert clean.mean() > 0.75
        assert np.median(np.abs(error)) < 1.0 and np.mean(np.abs(error) < 5) > 0.999
    assert not np.array_equal(pair.frames[0]["color"], pair.frames[1]["color"])


@pytest.mark.slow
def test_desk_pair_knows_the_motion_between_its_views(pair):
    first, second = pair.poses
    assert np.allclose(compose(first, pair.truth["T_first_second"]), second)


@pytest.mark.slow
def test_lettered_box_knows_its_planes_and_its_print():
    output = recipe("lettered_box").make()
    check_form(output)
    camera, box = PinholeCamera(**output.camera), output.meta["label_names"].index("box")
    desk, corners, ink = (output.truth[name] for name in ("desk_plane", "box_corners", "ink"))
    assert corners.shape == (8, 3) and np.linalg.matrix_rank(corners - corners.mean(axis=0)) == 3
    assert np.allclose(np.sort(corners @ desk[:3] + desk[3]), [0, 0, 0, 0, 0.17, 0.17, 0.17, 0.17], atol=1e-6)
    for frame, T, printed in zip(output.frames, output.poses, ink, strict=True):
        assert printed.shape == frame["labels"].shape and printed.dtype == bool
        assert (frame["labels"][printed] == box).all() and 4000 < printed.sum() < 7000
        bright = frame["color"].min(axis=-1)
        assert np.median(bright[printed]) > 130 > 70 > np.median(bright[(frame["labels"] == box) & ~printed])
        points = apply(T, deproject(frame["depth_truth"], camera, dtype=np.float64)[printed])
        sides = ConvexHull(corners).equations  # a printed pixel lies on a side of the box
        assert np.abs((points @ sides[:, :3].T + sides[:, 3]).max(axis=1)).max() < 1e-4
    raw = [frame["depth_raw"] for frame in output.frames]
    assert all(0.85 < (depth[printed] > 0).mean() for depth, printed in zip(raw, ink, strict=True))


def test_the_path_of_living_room():
    poses = living_room_path(recipe("living_room").seed)
    assert len(poses) == 30 and 0.9 <= path_length(poses) <= 1.5


@pytest.mark.slow
def test_arrays_repeat_bit_for_bit_in_other_processes_and_with_other_thread_counts():
    prints = []
    for threads in ("1", "2"):
        environment = {**os.environ, "OPENBLAS_NUM_THREADS": threads, "PYTHONPATH": str(ROOT)}
        command = [sys.executable, "-c", FINGERPRINT, "desk_pair", threads]
        done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=240)
        assert done.returncode == 0, done.stderr
        prints.append(done.stdout.strip())
    assert len(prints[0]) == 64 and prints[0] == prints[1]


@pytest.mark.slow
def test_another_seed_is_another_animal(bunny):
    other = recipe("bunny_like").make(seed=8)
    assert other.clouds["cloud"]["points"].shape != bunny.clouds["cloud"]["points"].shape


@pytest.mark.parametrize("seed", [-3, 2.5, "7", True])
def test_a_bad_seed_is_refused_in_one_sentence(seed):
    with pytest.raises(ValueError, match="non-negative integer") as caught:
        recipe("bunny_like").make(seed=seed)
    assert "\n" not in str(caught.value)


@pytest.fixture(scope="module")
def outlier_shot():
    from course_lib.camera.pinhole import preset
    from course_lib.simulate import outlier_desk
    from course_lib.simulate.scenes import desk

    camera = preset("d455_depth_424x240")
    return camera, outlier_desk.shoot(desk(3), camera, np.random.default_rng(3))


@pytest.mark.slow
def test_every_point_of_an_outlier_desk_is_labelled_by_its_distance_to_the_truth(outlier_shot):
    """What is called a surface lies near one; what is called an outlier lies far from all."""
    from course_lib.geometry.transforms import apply
    from course_lib.simulate import outlier_desk
    from course_lib.simulate.scenes import desk

    camera, shot = outlier_shot
    rng = np.random.default_rng(3)
    mesh, _ = outlier_desk.add_thin_things(desk(3), rng).labelled_mesh()
    from course_lib.surface.metrics import distance_to_surface

    off = distance_to_surface(apply(shot.pose, shot.points.astype(float)), mesh)
    sigma = d455.depth_sigma(shot.points[:, 2], camera)
    wrong = shot.kinds >= outlier_desk.FLYING
    assert (off[wrong] > outlier_desk.NEAR_SURFACE * sigma[wrong] * 0.999).all()
    assert np.mean(off[~wrong] < 4 * sigma[~wrong] + 0.002) > 0.999
    for kind in range(1, 6):
        assert np.mean(shot.kinds == kind) > 0.001, outlier_desk.KINDS[kind]
    assert 0.01 < wrong.mean() < 0.06


@pytest.mark.slow
def test_reflections_lie_behind_the_glass_and_points_are_the_frames_pixels(outlier_shot):
    from course_lib.simulate import outlier_desk

    _, shot = outlier_shot
    measured = shot.frame["depth_raw"] > 0
    assert measured.sum() == len(shot.points) == len(shot.kinds) == len(shot.colors)
    np.testing.assert_allclose(shot.points[:, 2] * 1000, shot.frame["depth_raw"][measured], atol=0.01)
    mirrored = shot.kinds == outlier_desk.REFLECTION
    assert (shot.points[mirrored, 2] > shot.frame["depth_truth"][measured][mirrored]).all()
    assert (shot.frame["artefacts"][measured][mirrored] == outlier_desk.MIRRORED).all()


@pytest.mark.slow
def test_an_outlier_desk_repeats(outlier_shot):
    from course_lib.simulate import outlier_desk
    from course_lib.simulate.scenes import desk

    camera, shot = outlier_shot
    again = outlier_desk.shoot(desk(3), camera, np.random.default_rng(3))
    assert np.array_equal(again.points, shot.points) and np.array_equal(again.kinds, shot.kinds)
    assert np.array_equal(again.frame["color"], shot.frame["color"])
