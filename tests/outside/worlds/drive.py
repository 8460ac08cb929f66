"""A drive through all rooms that a robot reaches, as a person would drive it: waypoints for `--path`.

Cells of 5 cm; what stands between 6 cm and 1 m over the floor is in the way, so nobody drives under tables.
In each room the robot goes near every corner, the nearest next; ways keep off walls where there is room. The
seed moves the start, the order and the distance to the walls."""

import math

import numpy as np
import shapely
from scipy import ndimage
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

CELL_M = 0.05
ROBOT_RADIUS_M = 0.28
# What a robot's driver keeps clear besides, in doors too.
MARGIN_M = 0.03
# Between these heights over the floor something is in the way.
OBSTACLE_BAND_M = (0.06, 1.0)
# Ways with less than this to the sides are longer than they are, by up to a few times.
COMFORT_M = 0.7
SPEED_M_S, TURN_DEG_S, CORNER_M = 0.35, 40.0, 0.4
# Every roomy place of a room is this near to a stop, with at most so many stops.
SPREAD_M, MOST_STOPS = 1.9, 14
# A sharper turn is driven as two, this far apart.
SHARP_DEG, TURN_ROUND_M = 100.0, 0.22
# Sharper turns no drive can have; so often they are turned anew.
REFUSED_DEG, PASSES = 148.0, 2
NEIGHBORS = [(1, 0), (0, 1), (1, 1), (1, -1), (2, 1), (1, 2), (2, -1), (1, -2)]


class Floor:
    """Where the robot can be: clearance of each cell, and the cells that it reaches."""

    def __init__(self, rooms, passages, obstacles_m):
        domain = shapely.unary_union([*rooms, *[passage.buffer(0.02) for passage in passages]])
        self.low = np.array(domain.bounds[:2]) - 3 * CELL_M
        shape = np.ceil((np.array(domain.bounds[2:]) - self.low) / CELL_M).astype(int) + 3
        self.shape = tuple(shape)
        centers = self.point(np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), -1))
        free = shapely.contains_xy(domain, centers[..., 0], centers[..., 1])
        taken = np.floor((obstacles_m - self.low) / CELL_M).astype(int)
        taken = taken[((taken >= 0) & (taken < shape)).all(axis=1)]
        free[tuple(taken.T)] = False
        self.clearance = ndimage.distance_transform_edt(free) * CELL_M - CELL_M / 2
        pieces, _ = ndimage.label(self.clearance >= ROBOT_RADIUS_M + MARGIN_M, np.ones((3, 3)))
        sizes = np.bincount(pieces.ravel())
        sizes[0] = 0
        self.reached = pieces == sizes.argmax() if sizes.max() else np.zeros(self.shape, bool)
        self.in_room = [shapely.contains_xy(room, centers[..., 0], centers[..., 1]) for room in rooms]
        self.centers = centers
        self.graph = self._graph()

    def point(self, cell):
        return self.low + (np.asarray(cell) + 0.5) * CELL_M

    def _graph(self):
        index = np.arange(self.reached.size).reshape(self.shape)
        dear = 1 + 6 * np.clip(1 - self.clearance / COMFORT_M, 0, 1) ** 2
        rows, columns, costs = [], [], []
        for dx, dy in NEIGHBORS:
            a = (slice(0, self.shape[0] - dx), slice(max(0, -dy), self.shape[1] - max(0, dy)))
            b = (slice(dx, None), slice(max(0, dy), self.shape[1] + min(0, dy)))
            both = self.reached[a] & self.reached[b]
            rows.append(index[a][both])
            columns.append(index[b][both])
            costs.append(math.hypot(dx, dy) * CELL_M * 0.5 * (dear[a] + dear[b])[both])
        rows, columns, costs = map(np.concatenate, (rows, columns, costs))
        size = self.reached.size
        return csr_matrix((costs, (rows, columns)), (size, size))

    def least_clearance(self, a, b):
        """The least clearance on the straight way between two points."""
        steps = max(2, int(math.dist(a, b) / (CELL_M / 2)))
        points = np.linspace(a, b, steps)
        cells = np.floor((points - self.low) / CELL_M).astype(int)
        return self.clearance[tuple(cells.T)].min()


def targets(floor, room, inside, random):
    """Cells near the corners of a room, as far from the walls as a driver of this seed likes it."""
    cells = np.argwhere(floor.reached & inside)
    if len(cells) * CELL_M**2 < 0.2:
        return []
    points, clearance = floor.point(cells), floor.clearance[tuple(cells.T)]
    wanted = min(random.uniform(0.5, 0.85), 0.85 * clearance.max())
    roomy = np.flatnonzero(clearance >= wanted)
    found = []
    for corner in np.array(room.simplify(0.3).exterior.coords)[:-1]:
        found.append(roomy[np.linalg.norm(points[roomy] - corner, axis=1).argmin()])
    # A room that is larger than its corners gets more stops, those farthest from all others first.
    kept, far = [], np.full(len(points), np.inf)
    while found or (len(kept) < MOST_STOPS and far[roomy].max() > SPREAD_M):
        best = found.pop(0) if found else roomy[far[roomy].argmax()]
        if far[best] > 0.8:
            kept.append((np.ravel_multi_index(cells[best], floor.shape), points[best]))
            far = np.minimum(far, np.linalg.norm(points - points[best], axis=1))
    return kept


def visit(floor, rooms, random):
    """Cells in the order in which they are visited, and the indices of the rooms entered."""
    stops = [
        (room, *target)
        for room in range(len(rooms))
        for target in targets(floor, rooms[room], floor.in_room[room], random)
    ]
    if len(stops) < 2:
        raise ValueError("no room that a robot can drive through")
    cells = [cell for _, cell, _ in stops]
    costs, before = dijkstra(floor.graph, directed=False, indices=cells, return_predecessors=True)
    between = costs[:, cells]
    order, left = [int(random.integers(len(stops)))], set(range(len(stops)))
    left.discard(order[0])
    while left:
        here = order[-1]
        same = [stop for stop in left if stops[stop][0] == stops[here][0]]
        choice = min(same or left, key=lambda stop: (between[here][stop] * random.uniform(0.95, 1.05), stop))
        order.append(choice)
        left.discard(choice)
    # Back to where it began: every doorway is passed in both directions.
    order.append(order[0])
    way = [cells[order[0]]]
    for a, b in zip(order, order[1:]):
        leg, at = [], cells[b]
        while at != cells[a]:
            leg.append(at)
            at = before[a][at]
        way += leg[::-1]
    return way, sorted({room for room, _, _ in stops}), {cells[stop] for stop in order}


def straightened(floor, way, kept):
    """Straight legs between the stops where these are as far from the walls as the way was."""
    points = [floor.point(np.unravel_index(cell, floor.shape)) for cell in way]
    out, at = [points[0]], 0
    while at < len(points) - 1:
        last = at + 1
        for to in range(at + 2, min(at + 400, len(points))):
            if way[to - 1] in kept:
                break
            least = min(floor.clearance[np.unravel_index(way[k], floor.shape)] for k in range(at, to + 1))
            if floor.least_clearance(points[at], points[to]) >= min(least, 0.55) - 1e-9:
                last = to
        at = last
        out.append(points[at])
    return out


def drivable(points):
    """The same way with sharp turns driven as two. Beside a leg that is as short as the two are apart one of
    them may be sharper still: those are turned once more, nearer to each other."""
    points = turned(points, SHARP_DEG, TURN_ROUND_M)
    apart_m = TURN_ROUND_M
    for _ in range(PASSES):
        corners = zip(points, points[1:], points[2:])
        if not any(abs(turn_deg(b - a, c - b)) > REFUSED_DEG for a, b, c in corners):
            break
        apart_m /= 2
        points = turned(points, REFUSED_DEG, apart_m)
    return points


def turn_deg(u, v):
    return math.degrees(math.atan2(u[0] * v[1] - u[1] * v[0], u @ v))


def turned(points, sharp_deg, apart_m):
    """The same way with sharp turns driven as two: a robot that turns round on the spot, nearly."""
    out = [points[0]]
    for a, b, c in zip(points, points[1:], points[2:]):
        u, v = b - a, c - b
        turn = turn_deg(u, v)
        if abs(turn) < sharp_deg:
            out.append(b)
            continue
        middle = u / np.linalg.norm(u) - v / np.linalg.norm(v)
        across = np.array([-middle[1], middle[0]]) / np.linalg.norm(middle) * math.copysign(apart_m / 2, turn)
        out += [b - across, b + across]
    return [*out, points[-1]]


def plan(rooms, passages, obstacles_m, seed):
    """Waypoints, the indices of the rooms entered, and the least clearance of the legs."""
    random = np.random.default_rng(seed)
    floor = Floor(rooms, passages, obstacles_m)
    way, entered, kept = visit(floor, rooms, random)
    points = drivable(straightened(floor, way, kept))
    apart = [points[0]] + [b for a, b in zip(points, points[1:]) if math.dist(a, b) > 0.03]
    least = min(floor.least_clearance(a, b) for a, b in zip(apart, apart[1:]))
    return [[round(float(v), 3) for v in p] for p in apart], entered, least


def path_toml(waypoints, floor_z_m, without_objects):
    rows = ",\n".join(f"  [{x}, {y}]" for x, y in waypoints)
    gone = ", ".join(f'"{name}"' for name in without_objects)
    return (
        f'name = "rooms"\nwaypoints_m = [\n{rows}\n]\nfloor_z_m = {floor_z_m}\nspeed_m_s = {SPEED_M_S}\n'
        f"turn_deg_s = {TURN_DEG_S}\ncorner_m = {CORNER_M}\nwithout_objects = [{gone}]\n"
    )
