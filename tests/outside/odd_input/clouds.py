"""Point clouds that are no building, and files that are no cloud, given to `biplane planes`."""

import json
from pathlib import Path

import numpy as np
from pypcd4 import Encoding

from odd_input.files import e57, las, pcd, ply, ptx, xyz
from odd_input.shapes import flat, random, room
from odd_input.trials import expect, fails, run


def planes(name, points, least=0, most=0, says="", noise=None, on=None, largest=0.0):
    """Runs `planes`; the number of planes lies between two bounds, and so does the share of points that are
    on planes."""
    code, text = run(name, "planes", name, "-o", "out", "--force")
    expect(name, code == 0, f"exit code {code}: {text.strip()[-200:]}")
    if code != 0:
        return
    report = json.loads(Path("out/planes.json").read_text())
    labels = np.fromfile(Path("out/labels.bin"), "<i4")
    expect(name, len(labels) == len(points), f"{len(labels)} labels for {len(points)} points")
    found = report["planes"]
    expect(name, least <= len(found) <= most, f"{len(found)} planes, expected {least} to {most}")
    expect(name, says in text, f"does not say `{says}`: {text.strip()[-200:]}")
    share, first = np.mean(labels >= 0), np.mean(labels == 0)
    expect(name, on is None or on[0] <= share <= on[1], f"{share:.3f} of the points are on planes")
    expect(name, first >= largest, f"the largest plane has {first:.3f} of the points")
    is_nowhere = ~np.isfinite(points).all(axis=1)
    expect(name, not (labels[is_nowhere] >= 0).any(), "a point that is nowhere is on a plane")
    for number, plane in enumerate(found):
        own = points[labels == number]
        off = own @ np.array(plane["normal"]) - plane["offset_m"]
        rms = float(np.sqrt(np.mean(off**2)))
        expect(
            name,
            len(own) == plane["points"] >= 50,
            f"plane {number} has {len(own)} points, {plane['points']} are told",
        )
        expect(name, rms <= 2.2 * (noise or report["sigma_m"]), f"plane {number} is not flat: {rms:.3f} m")
        spread = np.linalg.svd(own - own.mean(axis=0), compute_uv=False) / np.sqrt(len(own))
        expect(name, spread[1] > spread[2], f"plane {number} is a line")


def clouds():
    inside = room()
    scattered(inside)
    files_of_one_room(inside)
    units(inside)
    surfaces()
    scans(inside)


def scattered(inside):
    """Points that lie nowhere in particular, at no place, many times at one, or among strays."""
    for name, listed in {
        "one": [[1, 2, 3]],
        "two": [[1, 2, 3], [2, 3, 4]],
        "line": np.c_[np.linspace(0, 100, 20_000), np.zeros((20_000, 2))],
        "slanting": np.outer(np.linspace(0, 30, 20_000), [1, 1, 0.5]) + random.normal(0, 0.02, (20_000, 3)),
        "thread": np.c_[np.linspace(0, 100, 20_000), random.normal(0, 0.02, (20_000, 2))],
        "place": np.tile([5.0, 5.0, 5.0], (100_000, 1)),
        "fog": random.uniform(-3, 9, (360_000, 3)),
    }.items():
        points = np.asarray(listed, float)
        planes(ply(f"{name}.ply", points), points)
    holes = inside.copy()
    holes[::3] = np.nan
    holes[1::50, 1] = np.inf
    planes(ply("holes.ply", holes), holes, 6, 6, on=(0.6, 0.67))
    for copies in (2, 3, 10):
        points = np.tile(inside, (copies, 1))
        planes(ply(f"copies{copies}.ply", points), points, 6, 6, on=(0.98, 1))
    strays = np.vstack([inside, random.uniform(-3, 9, (9 * len(inside), 3))])
    planes(ply("strays.ply", strays), strays, 0, 6)


def files_of_one_room(inside):
    """The same room in every kind of file, and far from the origin."""
    for numbers in ("<f4", "<f8", ">f4", ">f8"):
        planes(ply("room.ply", inside, numbers), inside, 6, 6, on=(0.98, 1))
    for name, version, form in (
        ("room.las", "1.2", 0),
        ("room.laz", "1.2", 3),
        ("room14.laz", "1.4", 6),
        ("room14.las", "1.4", 7),
    ):
        planes(las(name, inside, version=version, form=form), inside, 6, 6, on=(0.98, 1))
    for scans in (1, 3):
        planes(e57("room.e57", inside, scans), inside, 6, 6, on=(0.98, 1))
    for encoding in Encoding:
        planes(pcd("room.pcd", inside, encoding), inside, 6, 6, on=(0.98, 1))
    for name, header, separator in (
        ("room.xyz", "", " "),
        ("room.csv", "x,y,z", ","),
        ("room.pts", str(len(inside)), " "),
    ):
        planes(xyz(name, inside, header, separator), inside, 6, 6, on=(0.98, 1))
    halves = [Path(xyz("half.pts", half, str(len(half)))).read_text() for half in np.array_split(inside, 2)]
    Path("two.pts").write_text("".join(halves))
    planes("two.pts", inside, 6, 6, on=(0.98, 1))
    for count in (1, 3):
        planes(ptx("room.ptx", inside, count), inside, 6, 6, on=(0.98, 1))
    holes = inside.copy()
    holes[::3] = np.nan
    planes(ptx("holes.ptx", holes), holes, 6, 6, on=(0.6, 0.67))
    utm = inside + [6e6, 5.5e6, 300.0]
    planes(e57("utm.e57", utm), utm, 6, 6, on=(0.98, 1))
    planes(ptx("utm.ptx", utm), utm, 6, 6, on=(0.98, 1))
    planes(xyz("utm.xyz", utm), utm, 6, 6, on=(0.98, 1))
    planes(ply("utm.ply", utm, "<f8"), utm, 6, 6, on=(0.98, 1))
    planes(las("utm.laz", utm), utm, 6, 6, on=(0.98, 1))
    stray = np.vstack([utm, np.zeros((5, 3))])
    planes(ply("stray.ply", stray, "<f8"), stray, 6, 6, on=(0.98, 1))
    planes(ply("coarse.ply", utm), utm, 0, 0, says="32-bit numbers")


def units(inside):
    """Other units: nothing is found, and why is said."""
    planes(ply("millimeters.ply", 1000 * inside), inside, 0, 0, says="in another unit?")
    planes(ply("kilometers.ply", inside / 1000), inside, 0, 0, says="in another unit?")
    for power in (-30, -9, 9, 30):
        planes(ply("power.ply", inside * 10.0**power), inside, 0, 0, says="no planes")
    fails(ply("beyond.ply", inside * 1e300, "<f8"), "none of the", "finite")


def surfaces():
    """One surface, however large (a false step or two of chance are a known fault); curved walls."""
    for across, step in ((1000, 0.05), (300, 0.1)):
        points = flat(across, across, step, 0.02)
        planes(ply("floor.ply", points), points, 1, 3, on=(0.99, 1), largest=0.99)
    points = np.c_[random.uniform(0, 1000, (500_000, 2)), random.normal(0, 0.02, 500_000)]
    planes(ply("sparse.ply", points), points, 0, 1, says="most points have no other within delta")

    # Strips of curved walls are as wide as the noise allows, which is when they bulge by at least 0.4 of it.
    for radius, noise in ((0.1, 0.003), (1, 0.01), (3, 0.02), (10, 0.02), (30, 0.02)):
        most = np.pi / np.arccos(1 - 0.4 * max(noise, 0.005) / radius)
        turn, far = random.uniform(0, 2 * np.pi, 100_000), radius + random.normal(0, noise, 100_000)
        points = np.c_[far * np.cos(turn), far * np.sin(turn), random.uniform(0, 3, 100_000)]
        planes(ply("pipe.ply", points), points, 0, most, noise=max(noise, 0.005))


def scans(inside):
    """Scans and beams that are none."""
    number = np.arange(len(inside))
    for name, scan, beam in (
        ("wide", number, np.where(number == 5, 65534, 0)),
        ("long", 2**31 - 1 - number, number % 180),
        ("mixed", random.integers(0, 300, len(inside)), random.integers(0, 200, len(inside))),
        ("negative", np.full(len(inside), -5), number * 0),
    ):
        planes(ply(f"{name}.ply", inside, columns={"scan": scan, "beam": beam}), inside, 6, 6, on=(0.98, 1))
    planes(ply("one_scan.ply", inside, columns={"scan": number * 0, "beam": number % 361}), inside)


def broken_clouds():
    inside = room(6000)
    broken_ply(inside)
    broken_las(inside)
    broken_others(inside)
    broken_words()


def broken_ply(inside):
    """Headers that lie, and files that are no PLY."""
    fails(ply("none.ply", np.zeros((0, 3))), "holds no point")
    fails(ply("nowhere.ply", np.full((100, 3), np.nan)), "none of the 100 points has finite coordinates")
    for claim in (6001, 4_000_000_000, 2**63, 2**64 + 1):
        fails(ply("boast.ply", inside, claim=claim), "vertex")
    fails(ply("no_z.ply", inside, header=lambda text: text.replace("float z", "float zz")), "x, y and z")
    fails(
        ply("type.ply", inside, header=lambda text: text.replace("float z", "quad z")),
        "line 6 of the PLY header",
    )
    fails(
        ply("list.ply", inside, header=lambda text: text.replace("float z", "list int float z")), "x, y and z"
    )
    fails(
        ply("middle.ply", inside, header=lambda text: text.replace("little", "middle")),
        "line 2 of the PLY header",
    )
    fails(ply("endless.ply", inside, header=lambda text: text.replace("end_header\n", "")), "PLY header")
    Path("long.ply").write_bytes(b"ply\nformat ascii 1.0\ncomment " + b"x" * 10_000_000)
    fails("long.ply", "PLY header")
    coordinates = "".join(f"property float {axis}\n" for axis in "xyz")
    ascii_head = f"ply\nformat ascii 1.0\nelement vertex 2\n{coordinates}end_header\n"
    Path("words.ply").write_text(ascii_head + "1 2 3\n1 zwei 3\n")
    fails("words.ply", "vertex 1", "zwei")
    contents = {
        "empty.ply": b"",
        "p.ply": b"ply",
        "zeros.ply": bytes(4096),
        "letters.ply": b"hello world\n" * 99,
    }
    for name, content in contents.items():
        Path(name).write_bytes(content)
        fails(name, "cannot read")


def broken_las(inside):
    """Files that are cut off, and files with a damaged byte."""
    for name in ("las.las", "laz.laz"):
        whole = Path(las(name, inside)).read_bytes()
        for end in (4, 100, 226, 227, 300, len(whole) // 2, len(whole) - 1):
            Path(name).write_bytes(whole[:end])
            fails(name, "LAS file")
        for at in list(range(94, 131)) + list(range(227, 240)) + list(range(len(whole) - 16, len(whole))):
            # Damaged, it is an error or another cloud; `run` sees to panics, hangs and memory.
            Path(name).write_bytes(whole[:at] + b"\xff" + whole[at + 1 :])
            run(f"{name} with byte {at} damaged", "planes", name, "-o", "out", "--force")
    fails(las("nothing.las", np.zeros((0, 3))), "holds no point")
    fails("no/such/file.ply", "no/such/file.ply does not exist")


def broken_others(inside):
    """Files that are cut off, of formats whose points only count."""
    for make, name in ((e57, "cut.e57"), (pcd, "cut.pcd")):
        whole = Path(make(name, inside)).read_bytes()
        for end in (48, 300, len(whole) // 2, len(whole) - 1):
            Path(name).write_bytes(whole[:end])
            fails(name, f"the {name[-3:].upper()} file")
    whole = Path(ptx("cut.ptx", inside)).read_text()
    for end, says in ((20, "line 3"), (3 * len(whole) // 4, "in scan 1"), (len(whole) - 20, "in scan 1")):
        Path("cut.ptx").write_text(whole[:end])
        fails("cut.ptx", says)
    words = Path(xyz("words.xyz", inside[:5]))
    words.write_text(words.read_text() + "1 zwei 3\n")
    fails("words.xyz", "line 6", "zwei")


def broken_words():
    """Command lines that are none."""
    for line in (
        "planes",
        "planes room.ply",
        "planes room.ply -o x --sigma 0",
        "planes room.ply -o x --sigma nan",
        "planes room.ply -o x --delta -1",
        "planes room.ply -o x --threads 0",
        "compact room.ply -o x --max-triangles many",
        "compact",
        "build",
        "build room.ply",
    ):
        code, text = run(line, *line.split())
        expect(line, code == 2 and "error:" in text, f"exit code {code}: {text[:200]}")
