"""Planes seen in perspective."""

import numpy as np


def homography(points, images):
    """The 3 x 3 map that takes four points of a plane to their images; its last entry is 1."""
    rows = []
    for (x, y), (u, v) in zip(points, images):
        rows += [[x, y, 1, 0, 0, 0, -u * x, -u * y], [0, 0, 0, x, y, 1, -v * x, -v * y]]
    map_ = np.linalg.solve(np.array(rows, dtype=float), np.ravel(images).astype(float))
    return np.append(map_, 1).reshape(3, 3)


def mapped(map_, points):
    """The images of points, of shape (n, 2)."""
    images = np.column_stack([points, np.ones(len(points))]) @ map_.T
    return images[:, :2] / images[:, 2:]
