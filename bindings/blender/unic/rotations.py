# SPDX-License-Identifier: GPL-3.0-or-later OR MIT OR Apache-2.0
"""Rotations and axes on numpy arrays, in f64. Does not need Blender."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

# unic has +Y up and characters that face +Z; Blender has +Z up and characters that face -Y.
UNIC_FROM_BLENDER: Array = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


def to_unic(points: Array) -> Array:
    """Points (..., 3) of Blender in the axes of unic."""
    return points @ UNIC_FROM_BLENDER.T


def to_blender(points: Array) -> Array:
    """Points (..., 3) of unic in the axes of Blender."""
    return points @ UNIC_FROM_BLENDER


def nearest_rotations(matrices: Array) -> Array:
    """Rotations (..., 3, 3) nearest to matrices, which may be scaled and slightly sheared."""
    left, _, right = np.linalg.svd(matrices)
    # A mirrored matrix has no rotation near it: the axis of the smallest scale is turned.
    left[..., :, 2] *= np.sign(np.linalg.det(left @ right))[..., None]
    return left @ right


def quaternions(rotations: Array) -> Array:
    """Unit quaternions (N, 4) x, y, z, w with w >= 0 of rotation matrices (N, 3, 3)."""
    m = rotations
    # Four times the products of one component with all; the row of the largest one is exact.
    trace = m[:, 0, 0] + m[:, 1, 1] + m[:, 2, 2]
    x, y, z = (1 + 2 * m[:, i, i] - trace for i in range(3))
    yz, zx, xy = m[:, 2, 1] + m[:, 1, 2], m[:, 0, 2] + m[:, 2, 0], m[:, 1, 0] + m[:, 0, 1]
    xw, yw, zw = m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]
    rows = np.array([[x, xy, zx, xw], [xy, y, yz, yw], [zx, yz, z, zw], [xw, yw, zw, 1 + trace]])
    largest = np.stack([x, y, z, 1 + trace]).argmax(axis=0)
    chosen = rows[largest, :, np.arange(len(m))]
    chosen /= np.linalg.norm(chosen, axis=1, keepdims=True)
    return chosen * np.where(chosen[:, 3:] < 0, -1.0, 1.0)


def axis_angles(rotations: Array) -> Array:
    """Axis-angle vectors (N, 3) of at most half a turn, of rotation matrices (N, 3, 3)."""
    quats = quaternions(rotations)
    sine = np.linalg.norm(quats[:, :3], axis=1, keepdims=True)
    angle = 2 * np.arctan2(sine, quats[:, 3:])
    # Near zero the vector is twice the quaternion's.
    return quats[:, :3] * np.where(sine > 1e-12, angle / np.maximum(sine, 1e-12), 2.0)


def between(first: Array, second: Array, share: float) -> Array:
    """Quaternions (N, 4) on the shorter way between two arrays of them; `share` is 0 to 1."""
    second = second * np.where((first * second).sum(axis=1, keepdims=True) < 0, -1.0, 1.0)
    cosine = np.clip((first * second).sum(axis=1, keepdims=True), -1.0, 1.0)
    angle = np.arccos(cosine)
    sine = np.sin(angle)
    # Nearly equal quaternions are mixed linearly: the quotients of sines lose their digits.
    near = sine < 1e-6
    safe = np.where(near, 1.0, sine)
    a = np.where(near, 1.0 - share, np.sin((1.0 - share) * angle) / safe)
    b = np.where(near, share, np.sin(share * angle) / safe)
    mixed = a * first + b * second
    return mixed / np.linalg.norm(mixed, axis=1, keepdims=True)
