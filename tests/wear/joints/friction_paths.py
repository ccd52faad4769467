"""Paths of a friction contact in tests, and independent solutions for them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from wear.joints.friction_contact import FrictionContact, advance_contact
from wear.joints.law import march_joints

KT, KN, MU, LOAD = 10.0, 13.0, 0.6, 2.0
LAW = FrictionContact(KT, KN, MU, LOAD)
REACH = MU * LOAD / KT  # stretch at which the slider slips under the preload
LIFT = LOAD / KN  # lift at which the preload is gone


def lead_along_one(law, displacement, state=None, start=0.0):
    """Return what a march of a single joint along one direction finds."""
    path = np.asarray(displacement, float)[:, None, None]
    state = law.rest(1) if state is None else state
    return march_joints(law, state, np.full((1, 1), start), path)


def one(law, state, increment):
    """Return force, state, energy and tangent of a single joint."""
    answer = law.respond(np.atleast_2d(state), np.atleast_2d(np.asarray(increment, float)))
    return answer.force[0], answer.state[0], answer.dissipated[0], answer.tangent[0]


def derivative(law, state, increment):
    """Return force and its derivative by state and increment, from the scalar kernel."""
    force, end, jacobian = np.empty(3), np.empty(3), np.empty((3, 6))
    advance_contact(law.parameters[0], np.asarray(state, float), increment, force, end, jacobian)
    return force, jacobian


def central(law, state, increment, step=1e-6 * REACH):
    """Return the same derivative by central differences."""
    at = np.concatenate([state, increment])
    columns = []
    for change in step * np.eye(6):
        high, low = at + change, at - change
        upper, lower = one(law, high[:3], high[3:])[0], one(law, low[:3], low[3:])[0]
        columns.append((upper - lower) / (2.0 * step))
    return np.array(columns).T


def random_path(seed, points, size=3.0 * REACH, lift=1.6 * LIFT):
    """Return a random polygon ``(points, 3)`` that sticks, slips, lifts off and touches."""
    rng = np.random.default_rng(seed)
    return rng.uniform(-1.0, 1.0, (points, 3)) * [size, size, lift]


def lead(law, path, state=None, start=(0.0, 0.0, 0.0)):
    """March one joint through ``path`` ``(t, 3)``."""
    state = law.rest(1) if state is None else np.atleast_2d(state)
    return march_joints(law, state, np.array([start]), path[:, None, :])


def split(path, parts):
    """Return a polygon from the origin with every side cut into equal parts."""
    share = np.arange(1, parts + 1)[:, None] / parts
    corners = np.vstack([np.zeros(3), path])
    return np.vstack([a + share * (b - a) for a, b in pairwise(corners)])


def brute_force(path, steps):
    """Return the tangential force at every corner and the energy, by tiny radial returns."""
    x = y = lost = 0.0
    forces = []
    for a, b in pairwise(np.vstack([np.zeros(3), path])):
        dx, dy, dz = (float(d) for d in (b - a) / steps)
        z = float(a[2])
        for _ in range(steps):
            z += dz
            x, y = x + KT * dx, y + KT * dy
            limit, size = MU * max(LOAD + KN * z, 0.0), (x * x + y * y) ** 0.5
            if size > limit:
                lost += limit * (size - limit) / KT
                x, y = x * limit / size, y * limit / size
        forces.append((x, y))
    return np.array(forces), lost
