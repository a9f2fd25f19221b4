"""Points and derivatives of many surfaces at scattered parameters, all at once."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from mracad.bspline.basis import jet
from mracad.bspline.curve import homogeneous
from mracad.bspline.knots import Side
from mracad.bspline.surface import Net, evaluated

Array = np.ndarray
Place = tuple[Net, Array, tuple[Side, Side]]
"""A surface, parameters ``(q, 2)`` on it, and the limits taken at knots of u and of v."""

BLOCK = 20_000
"""Number of parameters that are evaluated at once: some hundred bytes each."""


def scattered(places: Sequence[Place], derivatives: int) -> tuple[Array, ...]:
    """Points and derivatives, ``(all parameters, k)`` each, as from :meth:`mracad.bspline.surface.Net.evaluate`.

    Surfaces with different numbers k of coordinates cannot be mixed.
    """
    sizes = [len(uv) for _, uv, _ in places]
    ends = np.cumsum([0, *sizes])
    found: list[Array] = []
    for those in _alike(places, sizes):
        parts = _evaluated([places[i] for i in those], derivatives)
        found = found or [np.empty((ends[-1], part.shape[1])) for part in parts]
        at = np.concatenate([np.arange(ends[i], ends[i + 1]) for i in those])
        for whole, part in zip(found, parts, strict=True):
            whole[at] = part
    return tuple(found)


def _alike(places: Sequence[Place], sizes: Sequence[int]) -> Iterator[list[int]]:
    """Positions of places on surfaces of equal degrees, in blocks."""
    blocks: dict[tuple[int, int, bool], tuple[list[int], int]] = {}
    for i, (net, _, _) in enumerate(places):
        key = net.u.degree, net.v.degree, net.weights is None
        those, size = blocks.get(key, ([], 0))
        if size and size + sizes[i] > BLOCK:
            yield those
            those, size = [], 0
        blocks[key] = [*those, i], size + sizes[i]
    yield from (those for those, _ in blocks.values())


def _evaluated(places: Sequence[Place], derivatives: int) -> tuple[Array, ...]:
    """Those of surfaces of equal degrees."""
    nets = {id(net): net for net, _, _ in places}
    begins = dict(
        zip(nets, np.cumsum([0, *(net.u.count * net.v.count for net in nets.values())]).tolist(), strict=False)
    )
    poles = np.concatenate(
        [(each := homogeneous(net.poles, net.weights)).reshape(-1, each.shape[-1]) for net in nets.values()]
    )
    orders = range(derivatives + 1)
    first_u, in_u = zip(*(jet(net.u, uv[:, 0], orders, side[0]) for net, uv, side in places), strict=True)
    first_v, in_v = zip(*(jet(net.v, uv[:, 1], orders, side[1]) for net, uv, side in places), strict=True)
    layout = np.array([(begins[id(net)], net.u.count, net.v.count) for net, _, _ in places])
    begin, count_u, count_v = np.repeat(layout, [len(uv) for _, uv, _ in places], axis=0).T[..., None]
    net = places[0][0]
    row = (np.concatenate(first_u)[:, None] + np.arange(net.u.degree + 1)) % count_u
    column = (np.concatenate(first_v)[:, None] + np.arange(net.v.degree + 1)) % count_v
    index = (begin + row * count_v)[:, :, None] + column[:, None, :]
    return evaluated(poles[index], np.concatenate(in_u), np.concatenate(in_v), net.weights is not None)
