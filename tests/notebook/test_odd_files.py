"""Files that other programs write: each is read right, or refused in one sentence.

Each is an input that Open3D's parsers read wrong, or that ended Python.
"""

from pathlib import Path

import numpy as np
import pytest

from course_lib.notebook import files
from course_lib.notebook._errors import Refusal

RNG = np.random.default_rng(3)
POINTS = RNG.normal(size=(101, 3)).astype(np.float32)
COLORS = RNG.integers(0, 256, (101, 3), dtype=np.uint8)
UTM = np.round([665190.0, 5648354.0, 243.0] + POINTS.astype(np.float64), 6)
XYZ = "\n".join(" ".join(f"{number:.6f}" for number in row) for row in POINTS)
CORNERS = b"0 0 0\n1 0 0\n0 1 0\n"


def table(**columns: tuple[str, np.ndarray]) -> np.ndarray:
    """Rows of fields: by name, the NumPy type and the numbers."""
    rows = np.zeros(len(POINTS), [(name, kind) for name, (kind, _) in columns.items()])
    for name, (_, numbers) in columns.items():
        rows[name] = numbers
    return rows


def xyz_and(kind: str = "", numbers: np.ndarray = COLORS, names: str = "red green blue", xyz: str = "xyz"):
    """Points, and more columns of one type."""
    columns = {name: ("<f4", POINTS[:, i]) for i, name in enumerate(xyz)}
    more = {name: (kind, numbers[:, i]) for i, name in enumerate(names.split())} if kind else {}
    return table(**columns, **more)


PLY_NAMES = {"<f4": "float", "<f8": "double", "|u1": "uchar", "<u2": "ushort", "<i4": "int"}


def ply(rows: np.ndarray, *head: str) -> bytes:
    fields = [f"property {PLY_NAMES[rows.dtype[name].str]} {name}" for name in rows.dtype.names]
    lines = ["ply", "format binary_little_endian 1.0", *head, f"element vertex {len(rows)}"]
    return "\n".join([*lines, *fields, "end_header", ""]).encode() + rows.tobytes()


def ascii_ply(faces: bytes = b"", corners: bytes = CORNERS) -> bytes:
    head = b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    element = b"element face %d\nproperty list uchar int vertex_indices\n" % faces.count(b"\n") if faces else b""
    return head + element + b"end_header\n" + corners + faces


def pcd(rows: np.ndarray, width: int, height: int) -> bytes:
    names, kinds = rows.dtype.names, [rows.dtype[name] for name in rows.dtype.names]
    types = " ".join("F" if kind.kind == "f" else "U" for kind in kinds)
    sizes = " ".join(str(kind.itemsize) for kind in kinds)
    head = f"VERSION 0.7\nFIELDS {' '.join(names)}\nSIZE {sizes}\nTYPE {types}\n"
    head += f"COUNT {' '.join('1' * len(names))}\nWIDTH {width}\nHEIGHT {height}\nVIEWPOINT 0 0 0 1 0 0 0\n"
    return (head + f"POINTS {len(rows)}\nDATA binary\n").encode() + rows.tobytes()


FILES = {
    "usual.xyz": f"{XYZ}\n".encode(),
    "usual.ply": ply(xyz_and()),
    "usual.pcd": pcd(xyz_and(), 101, 1),
    "colours_uchar.ply": ply(xyz_and("|u1")),
    "corners.ply": ascii_ply(),
    "no_final_newline.xyz": XYZ.encode(),
    "header_line.xyz": f"# x y z\n{XYZ}\n".encode(),
    "blank_line_at_end.xyz": f"{XYZ}\n\n".encode(),
    "utm.xyz": "".join(f"{x:.6f} {y:.6f} {z:.6f}\n" for x, y, z in UTM).encode(),
    "float_xy_double_z.ply": ply(table(x=("<f4", POINTS[:, 0]), y=("<f4", POINTS[:, 1]), z=("<f8", POINTS[:, 2]))),
    "colours_float.ply": ply(xyz_and("<f4")),
    "colours_int.ply": ply(xyz_and("<i4")),
    "colours_ushort.ply": ply(xyz_and("<u2", COLORS.astype(np.uint16) * 257)),
    "only_x_y.ply": ply(xyz_and(xyz="xy")),
    "only_red.ply": ply(xyz_and("|u1", names="red")),
    "capital_X_Y_Z.ply": ply(xyz_and(xyz="XYZ")),
    "labels_float.ply": ply(xyz_and("<f4", np.full((101, 1), 3), "labels")),
    "comment_says_end_header.ply": ply(xyz_and(), "comment end_header ends it", "obj_info num_cols 3"),
    "cr_only.ply": ascii_ply().replace(b"\n", b"\r"),
    "face_of_two_vertices.ply": ascii_ply(b"3 0 1 2\n2 1 2\n"),
    "label.pcd": pcd(xyz_and("<u4", np.arange(101)[:, None], "label"), 101, 1),
    "7x3_but_101_points.pcd": pcd(xyz_and(), 7, 3),
}
REFUSED = ("only_x_y.ply", "only_red.ply", "face_of_two_vertices.ply", "7x3_but_101_points.pcd")
OR_REFUSED = ("float_xy_double_z.ply", "colours_float.ply", "colours_int.ply", "capital_X_Y_Z.ply", "labels_float.ply")


def must_be_right(path: Path) -> None:
    """Read one of FILES as a learner does and compare it with what was written."""
    name = path.name
    if name == "face_of_two_vertices.ply":
        read = files.read_mesh
    else:
        read = files.read_organised if name == "7x3_but_101_points.pcd" else files.read_cloud
    if name in REFUSED + OR_REFUSED:
        try:
            cloud = read(path)
        except Refusal as refusal:
            assert name in str(refusal) and "\n" not in str(refusal) and str(refusal).endswith((".", "?"))
            return
        assert name not in REFUSED, f"{name} was read"
    else:
        cloud = read(path)
    if name in ("cr_only.ply", "corners.ply"):
        np.testing.assert_array_equal(cloud.points, np.eye(4)[[3, 0, 1], :3])
    else:
        np.testing.assert_allclose(cloud.points, UTM if name == "utm.xyz" else POINTS, rtol=0, atol=1e-6)
    if name.startswith("colours"):
        np.testing.assert_array_equal(cloud.colors, COLORS)
    if name == "labels_float.ply":
        assert cloud.labels is None
    if name == "label.pcd":
        np.testing.assert_array_equal(cloud.labels, np.arange(101))


@pytest.mark.parametrize("name", FILES)
def test_a_file_is_read_right_or_refused_in_one_sentence(tmp_path, name):
    path = tmp_path / name
    path.write_bytes(FILES[name])
    must_be_right(path)
