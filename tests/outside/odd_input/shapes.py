"""Points and triangles of simple shapes, noisy where they are asked to be. Meters."""

import numpy as np

random = np.random.default_rng(5)


def flat(across, along, step, noise):
    x, y = np.meshgrid(step * np.arange(across), step * np.arange(along))
    return np.c_[x.ravel(), y.ravel(), random.normal(0, noise, across * along)]


def room(count=40_000, noise=0.01):
    sides = []
    for axis in range(3):
        size = (6.0, 6.0, 3.0)
        for at in (0.0, size[axis]):
            side = random.uniform(0, 1, (count // 6, 3)) * size
            side[:, axis] = at
            sides.append(side)
    points = np.vstack(sides)
    return points + random.normal(0, noise, points.shape)


def woven(across, along, closed=False):
    """Triangles over a grid of points."""
    k = np.arange(across * along).reshape(along, across)
    k = np.c_[k, k[:, :1]] if closed else k
    a, b, c, d = k[:-1, :-1].ravel(), k[:-1, 1:].ravel(), k[1:, 1:].ravel(), k[1:, :-1].ravel()
    return np.vstack([np.c_[a, b, c], np.c_[a, c, d]])


def pipe(radius, height, step, noise):
    across, along = int(2 * np.pi * radius / step), int(height / step)
    turn, z = np.meshgrid(np.arange(across) * 2 * np.pi / across, step * np.arange(along))
    far = radius + random.normal(0, noise, turn.shape)
    return np.c_[(far * np.cos(turn)).ravel(), (far * np.sin(turn)).ravel(), z.ravel()], woven(
        across, along, True
    )


def ball(radius, step, noise):
    across = int(2 * np.pi * radius / step)
    turn, down = np.meshgrid(
        np.arange(across) * 2 * np.pi / across, np.linspace(0.05, np.pi - 0.05, across // 2)
    )
    far = radius + random.normal(0, noise, turn.shape)
    points = [far * np.cos(turn) * np.sin(down), far * np.sin(turn) * np.sin(down), far * np.cos(down)]
    return np.stack([p.ravel() for p in points], axis=1), woven(across, across // 2, True)


CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
SIDES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
