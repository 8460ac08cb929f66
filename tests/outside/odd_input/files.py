"""Clouds and meshes as files of the current folder: PLY, OBJ, LAS, E57, PCD, XYZ. Each
function returns the name that it was given."""

from pathlib import Path

import laspy
import numpy as np
import pye57
from pypcd4 import Encoding, PointCloud


def ply(name, points, numbers="<f4", columns=None, claim=None, faces=None, header=None):
    """A binary PLY; `numbers` is numpy's type of the coordinates, byte order first."""
    points = np.asarray(points, float).reshape(-1, 3)
    columns = columns or {}
    rows = np.empty(
        len(points), [(axis, numbers) for axis in "xyz"] + [(column, numbers[0] + "i4") for column in columns]
    )
    for k, axis in enumerate("xyz"):
        rows[axis] = points[:, k]
    for column, values in columns.items():
        rows[column] = values
    order, kind = {"<": "little", ">": "big"}[numbers[0]], {"f4": "float", "f8": "double"}[numbers[1:]]
    lines = ["ply", f"format binary_{order}_endian 1.0", f"element vertex {claim or len(points)}"]
    lines += [f"property {kind} {axis}" for axis in "xyz"] + [f"property int {column}" for column in columns]
    body = rows.tobytes()
    if faces is not None:
        lines += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
        whole = numbers[0] + "i4"
        body += b"".join(
            np.array([len(face)], "u1").tobytes() + np.array(face, whole).tobytes() for face in faces
        )
    text = "\n".join(lines + ["end_header", ""])
    Path(name).write_bytes((header(text) if header else text).encode() + body)
    return name


def obj(name, points, faces, more=""):
    """An OBJ file; `more` are lines that follow."""
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in points]
    lines += ["f " + " ".join(str(k + 1) for k in face) + "\n" for face in faces]
    Path(name).write_text("".join(lines) + more)
    return name


def las(name, points, scale=0.001, version="1.2", form=0):
    """A LAS or LAZ file, as its name ends."""
    header = laspy.LasHeader(version=version, point_format=form)
    points = np.asarray(points, float).reshape(-1, 3)
    header.offsets = np.floor(points.min(axis=0)) if len(points) else np.zeros(3)
    header.scales = np.full(3, scale)
    data = laspy.LasData(header)
    data.x, data.y, data.z = points.T
    data.write(name)
    return name


def e57(name, points, scans=1):
    """An E57 file whose scans each have a pose of their own, and points that it has to be applied to. pye57
    writes coordinates in 32 bits, so the pose has to bring points that are far away."""
    Path(name).unlink(missing_ok=True)
    file = pye57.E57(str(name), mode="w")
    for number, own in enumerate(np.array_split(np.asarray(points, float), scans)):
        half = 0.3 * (number + 1)
        cos, sin = np.cos(2 * half), np.sin(2 * half)
        world_from_scan = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
        place = np.floor(own.mean(axis=0)) + [10.0 * number, 3, 0.5]
        columns = dict(
            zip(
                ("cartesianX", "cartesianY", "cartesianZ"),
                ((own - place) @ world_from_scan).T.copy(),
                strict=True,
            )
        )
        file.write_scan_raw(columns, rotation=np.array([np.cos(half), 0, 0, np.sin(half)]), translation=place)
    file.close()
    return name


def pcd(name, points, encoding=Encoding.BINARY):
    """A PCD file with a color between, as cameras write it."""
    points = np.asarray(points, np.float32)
    colors = np.arange(len(points), dtype=np.float32)
    PointCloud.from_points(
        np.c_[points[:, :2], colors, points[:, 2]], ("x", "y", "rgb", "z"), (np.float32,) * 4
    ).save(name, encoding=encoding)
    return name


def ptx(name, points, scans=2):
    """A PTX file of scans in one column each, turned and moved by their matrices (row vectors). Points that
    are nowhere were not seen."""

    def words(values, digits):
        return " ".join(f"{value:.{digits}f}" for value in values)

    lines = []
    for number, own in enumerate(np.array_split(np.asarray(points, float), scans)):
        turn = 0.6 * (number + 1)
        axes = np.array([[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
        place = np.floor(np.nanmean(own, axis=0)) + [10.0 * number, 3, 0.5]
        seen = np.isfinite(own).all(axis=1)[:, None]
        lines += ["1", str(len(own)), words(place, 9)]
        lines += [words(axis, 12) for axis in axes]
        lines += [words(axis, 12) + " 0" for axis in axes] + [words(place, 9) + " 1"]
        lines += [words(row, 5) + " 0.5" for row in np.where(seen, (own - place) @ axes.T, 0)]
    Path(name).write_text("\n".join(lines) + "\n")
    return name


def xyz(name, points, header="", separator=" "):
    """A point a line."""
    np.savetxt(name, points, fmt="%.4f", delimiter=separator, header=header, comments="")
    return name
