"""Rings and sectors of them: in the plane about Y, in space about any axis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from fe_models.cyclic.cuts import Cyclic
from fe_models.meshes.structure_mesh import Body, named_mesh

INNER, OUTER, WIDTH = 20.0, 30.0, 6.0
Y = np.array([0.0, 1.0, 0.0])
# Direction of an axis that is not a global one.
OBLIQUE = np.array([1.0, 2.0, -0.5])
THROUGH = np.array([3.0, -2.0, 5.0])


def about(axis=Y, through=(0.0, 0.0, 0.0), sectors=6, low=("low",), high=("high",)):
    """Return the cuts of a sector."""
    return Cyclic(low, high, np.array(axis, float), np.array(through, float), sectors)


def sector(sectors, counts=(4, 5, 2), dimension=2, inner=INNER, axis=Y, through=None, moved=0.0):
    """Return a sector whose inner nodes are shifted, so that it has no symmetry.

    ``counts`` are elements along the radius, round the sector and along the axis. Boundaries: low,
    high, bore, rim, a pad on the rim that ends within it, in space also front and back. Nodes of
    the high cut are ``moved`` along it by up to this share of an element, and then do not match.
    """
    radial, round_, deep = counts
    r, t = np.linspace(inner, OUTER, radial + 1), np.linspace(0.0, 1.0, round_ + 1)
    y = np.linspace(0.0, WIDTH, deep + 1) if dimension == 3 else np.zeros(1)
    places = np.stack(np.meshgrid(r, t, y, indexing="ij"), axis=-1)
    rng = np.random.default_rng(1)
    inside = places[1:-1, 1:-1]
    steps = np.array([(OUTER - inner) / radial, 1.0 / round_, 0.0])
    inside += 0.15 * steps * rng.uniform(-1.0, 1.0, inside.shape)
    shifts = moved * rng.uniform(-1.0, 1.0, (radial - 1, len(y)))
    places[1:-1, -1, :, 0] += steps[0] * shifts
    if dimension == 3:
        depths = moved * rng.uniform(-1.0, 1.0, (radial + 1, deep - 1))
        places[:, -1, 1:-1, 2] += WIDTH / deep * depths
    radius, angle = places[..., 0].ravel(), 2.0 * np.pi / sectors * places[..., 1].ravel()
    # Angles from Z to X, as a turn about Y goes.
    points = np.stack([radius * np.sin(angle), places[..., 2].ravel(), radius * np.cos(angle)], 1)
    number = np.arange(len(points)).reshape(places.shape[:-1])
    cells = _cells(number)
    named = _boundaries(number, cells)
    if dimension == 2:
        return _merged("wheel", points, cells, named, 2)
    to_axis = _frame(axis)
    placed = points @ to_axis + (np.zeros(3) if through is None else through)
    return _merged("wheel", placed, cells, named, 3)


def curved(body):
    """Return the body with edges around its axis, Y, that are circular."""
    mesh = body.mesh
    ends = body.points[(mesh.edges if mesh.dim() == 3 else mesh.facets).T]
    depth, arms = ends[..., 1].mean(axis=1), ends * np.array([1.0, 0.0, 1.0])
    radii = np.linalg.norm(arms, axis=2)
    direction = (arms / radii[..., None]).sum(axis=1)
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    middles = radii.mean(axis=1)[:, None] * direction + np.outer(depth, Y)
    return replace(body, midsides=np.ascontiguousarray(middles[:, body.axes]))


def shoe(sectors, counts=(4, 5, 2), dimension=2):
    """Return a body on the pad of a sector, about Y, with boundaries pad and top."""
    _, round_, deep = counts
    r, t = OUTER + np.array([0.0, 3.0, 6.0]), np.arange(1, round_ - 1) / round_
    y = np.linspace(0.0, WIDTH, deep + 1) if dimension == 3 else np.zeros(1)
    places = np.stack(np.meshgrid(r, 2.0 * np.pi / sectors * t, y, indexing="ij"), axis=-1)
    radius, angle, depth = places.reshape(-1, 3).T
    points = np.stack([radius * np.sin(angle), depth, radius * np.cos(angle)], axis=1)
    number = np.arange(len(points)).reshape(places.shape[:-1])
    cells = _cells(number)
    faces = _boundaries(number, cells)
    return _merged("shoe", points, cells, {"pad": faces["bore"], "top": faces["rim"]}, dimension)


def turned(body, cyclic, count):
    """Return a body in another sector, with that sector's number in its names."""
    images = (body.points - cyclic.through) @ cyclic.turn(count).T + cyclic.through
    names = {f"{name}_{count}": facets for name, facets in body.mesh.boundaries.items()}
    mesh = type(body.mesh)(np.ascontiguousarray(images[:, body.axes].T), body.mesh.t)
    return Body(f"{body.name}_{count}", mesh.with_boundaries(body.mesh.boundaries | names))


def wheel(part, cyclic, faces=("pad",)):
    """Return the whole wheel of a sector, without the cuts and with separate ``faces``."""
    mesh, count = part.mesh, part.mesh.nvertices
    turns = [cyclic.turn(k) for k in range(cyclic.sectors)]
    points = np.concatenate(
        [(part.points - cyclic.through) @ turn.T + cyclic.through for turn in turns]
    )
    shifts = count * np.arange(cyclic.sectors)[:, None, None]
    cells = (mesh.t.T + shifts).reshape(-1, mesh.t.shape[0])
    named = {
        name: (part.facets(name) + shifts).reshape(-1, mesh.dim())
        for name in mesh.boundaries
        if name not in cyclic.boundaries
    }
    for name in set(faces) & set(named):
        of_sectors = named[name].reshape(cyclic.sectors, -1, mesh.dim())
        named |= {f"{name}_{k}": facets for k, facets in enumerate(of_sectors)}
    return _merged(part.name, points, cells, named, mesh.dim())


def _merged(name, points, cells, named, dimension):
    """Merge nodes at the same place."""
    tree = cKDTree(points)
    first = np.array([min(near) for near in tree.query_ball_point(points, 1e-8)])
    kept, place = np.unique(first, return_inverse=True)
    cells = place[cells]
    # Cells on an axis that have no size.
    whole = np.array([len(set(cell)) == len(cell) for cell in cells.tolist()])
    named = {
        label: np.array([f for f in place[facets].tolist() if len(set(f)) == len(f)])
        for label, facets in named.items()
    }
    axes = (0, 1, 2) if dimension == 3 else (0, 2)
    some = {label: facets for label, facets in named.items() if len(facets)}
    return Body(name, named_mesh(points[kept][:, axes], cells[whole], some))


def _cells(number):
    """Return simplices of a grid of nodes, with the same diagonal in all cells."""
    if number.shape[2] == 1:
        n = number[:, :, 0]
        a, b, c, d = n[:-1, :-1], n[1:, :-1], n[1:, 1:], n[:-1, 1:]
        return np.concatenate([np.stack(x, -1).reshape(-1, 3) for x in ((a, b, c), (a, c, d))])
    steps = {"r": (1, 0, 0), "t": (0, 1, 0), "y": (0, 0, 1)}
    cells = []
    for order in ("rty", "ryt", "try", "tyr", "yrt", "ytr"):
        at, corners = np.zeros(3, int), []
        for step in ("", *order):
            at = at + (steps[step] if step else (0, 0, 0))
            ends = [slice(k, n - 1 + k) for k, n in zip(at, number.shape, strict=True)]
            corners.append(number[tuple(ends)].ravel())
        cells.append(np.stack(corners, axis=1))
    return np.concatenate(cells)


def _boundaries(number, cells):
    """Return facets of the grid's sides, by the nodes on them."""
    faces = np.concatenate([np.delete(cells, k, axis=1) for k in range(cells.shape[1])])
    faces = np.unique(np.sort(faces, axis=1), axis=0)
    last = number.shape[1] - 1
    sides = {
        "bore": number[0],
        "rim": number[-1],
        "low": number[:, 0],
        "high": number[:, -1],
        "pad": number[-1, 1 : last - 1],
    }
    if number.shape[2] > 1:
        sides |= {"front": number[:, :, 0], "back": number[:, :, -1]}
    return {name: faces[np.isin(faces, nodes).all(axis=1)] for name, nodes in sides.items()}


def _frame(axis):
    """Return X, Y, Z as rows, turned so that Y is along an axis."""
    y = np.asarray(axis, float) / np.linalg.norm(axis)
    if np.allclose(y, Y):
        return np.eye(3)
    z = np.cross(y, [0.0, 0.0, 1.0])
    z /= np.linalg.norm(z)
    return np.array([np.cross(y, z), y, z])
