"""Control points of things."""

import numpy as np

import mracad


def nets(thing):
    return [surface.net.poles for surface in mracad.snapshot(thing).surfaces]


def moved(before, after):
    """Which surfaces differ."""
    return [not np.array_equal(a, b) for a, b in zip(nets(before), nets(after), strict=True)]
