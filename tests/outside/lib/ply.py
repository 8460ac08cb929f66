"""Binary PLY files, read and written with numpy alone."""

from lib import np
from lib.verdict import require

TYPES = {
    "float": "<f4",
    "double": "<f8",
    "int": "<i4",
    "uint": "<u4",
    "short": "<i2",
    "ushort": "<u2",
    "char": "i1",
    "uchar": "u1",
}


def header_of(file):
    """Elements in their order: name, count and numpy fields. Lists are taken to hold three values each:
    triangles."""
    elements, line, is_little = [], [], False
    while line != ["end_header"]:
        text = file.readline()
        require(text, "the header of a PLY file does not end")
        line = text.decode().split()
        is_little |= line == ["format", "binary_little_endian", "1.0"]
        if line[0] == "element":
            elements.append((line[1], int(line[2]), []))
        elif line[:2] == ["property", "list"]:
            elements[-1][2].extend([("corners", "u1"), (line[-1], TYPES[line[3]], 3)])
        elif line[0] == "property":
            elements[-1][2].append((line[2], TYPES[line[1]]))
    require(is_little, "a PLY file is not binary and little endian")
    return elements


def read(path):
    """Every element as an array with a field for each property."""
    with open(path, "rb") as file:
        return {
            name: np.frombuffer(file.read(count * np.dtype(fields).itemsize), fields, count)
            for name, count, fields in header_of(file)
        }


def vertices(path):
    """The vertices alone, which come first."""
    with open(path, "rb") as file:
        name, count, fields = header_of(file)[0]
        require(name == "vertex", f"{path} does not start with its vertices")
        return np.frombuffer(file.read(count * np.dtype(fields).itemsize), fields, count)


def xyz(rows):
    """Coordinates of rows as an array of three columns."""
    return np.stack([rows[axis].astype(float) for axis in "xyz"], axis=1)


def triangles(path):
    """The corners of every triangle of a mesh: triangle, corner, axis."""
    mesh = read(path)
    return xyz(mesh["vertex"])[mesh["face"]["vertex_indices"]]


def write_points(path, points):
    """Writes an array whose fields are x, y, z (32-bit numbers) and whole numbers."""
    with open(path, "wb") as file:
        file.write(f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n".encode())
        for name in points.dtype.names:
            file.write(f"property {'float' if name in 'xyz' else 'int'} {name}\n".encode())
        file.write(b"end_header\n" + points.tobytes())
