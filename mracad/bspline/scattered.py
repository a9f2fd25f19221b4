"""Points and derivatives of many surfaces at scattered parameters, all at once."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from mracad.bspline.basis import jet
from mracad.bspline.curve import homogeneous
from mracad.bspline.knots import Side
from mracad.bspline.surface import Net, evaluated
from mracad.bspline.vectors import cross

Array = np.ndarray
Place = tuple[Net, Array, tuple[Side, Side]]
"""A surface, parameters ``(q, 2)`` on it, and the limits taken at knots of u and of v."""

BLOCK = 20_000
"""Number of parameters that are evaluated at once: some hundred bytes each."""


def scattered(places: Sequence[Place], derivatives: int) -> tuple[Array, ...]:
    """Points and derivatives, ``(all parameters, k)`` each, as from :meth:`mracad.bspline.surface.Net.evaluate`.

    Surfaces with different numbers k of coordinates cannot be mixed.
    """
    return _gathered(_batches(places, derivatives), [net for net, _, _ in places])


class Scattered:
    """The functions at places, for surfaces over the same knots.

    Parameters
    ----------
    places : sequence of Place
    derivatives : {0, 1, 2}
    """

    def __init__(self, places: Sequence[Place], derivatives: int) -> None:
        self._batches = list(_batches(places, derivatives))

    def evaluate(self, nets: Sequence[Net]) -> tuple[Array, ...]:
        """Points and derivatives, as from :func:`scattered`, given the surface of each place."""
        return _gathered(self._batches, nets)


def normals(places: Sequence[Place], su: Array, sv: Array) -> Array:
    """Unit normals, ``(all parameters, 3)``, given ``S_u`` and ``S_v`` there; see
    :meth:`mracad.bspline.surface.Net.normals`."""
    sizes = [len(uv) for _, uv, _ in places]
    normal: Array = cross(su, sv)
    lengths = [np.linalg.norm(each, axis=1) for each in (su, sv, normal)]
    floors = np.repeat([net.least_tangents for net, _, _ in places], sizes, axis=0).T
    good = (lengths[2] > 1e-9 * lengths[0] * lengths[1]) & (lengths[0] >= floors[0]) & (lengths[1] >= floors[1])
    with np.errstate(invalid="ignore", divide="ignore"):
        normal /= lengths[2][:, None]
    ends = np.cumsum([0, *sizes])
    for k in np.unique(np.searchsorted(ends, np.flatnonzero(~good), side="right") - 1).tolist():
        own, (net, uv, limits) = slice(ends[k], ends[k + 1]), places[k]
        normal[own] = net.normals(uv, limits, (su[own], sv[own]))
    return normal


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


def _batches(places: Sequence[Place], derivatives: int) -> Iterator[_Batch]:
    sizes = [len(uv) for _, uv, _ in places]
    ends = np.cumsum([0, *sizes])
    for those in _alike(places, sizes):
        at = np.concatenate([np.arange(ends[i], ends[i + 1]) for i in those])
        yield _Batch.of(those, at, [places[i] for i in those], derivatives)


def _gathered(batches: Iterable[_Batch], nets: Sequence[Net]) -> tuple[Array, ...]:
    """What is evaluated batch by batch, in the order of places."""
    found = [(batch.at, batch.evaluate(nets)) for batch in batches]
    size = sum(len(at) for at, _ in found)
    every = tuple(np.empty((size, part.shape[1])) for part in found[0][1]) if found else ()
    for at, parts in found:
        for whole, part in zip(every, parts, strict=True):
            whole[at] = part
    return every


@dataclass(frozen=True, eq=False)
class _Batch:
    """The functions at places on surfaces of equal degrees.

    Attributes
    ----------
    at : ndarray of int (q,)
        Numbers of the parameters.
    firsts : list of int
        Places on different surfaces.
    rows, columns : ndarray of int (q, d + 1)
        Numbers whose sums are those of control points that matter, of the surfaces there one after another.
    in_u, in_v : ndarray (q, derivatives + 1, d + 1)
        Values and derivatives of their functions.
    """

    at: Array
    firsts: list[int]
    rows: Array
    columns: Array
    in_u: Array
    in_v: Array

    @classmethod
    def of(cls, those: Sequence[int], at: Array, places: Sequence[Place], derivatives: int) -> _Batch:
        """Those at places with the given positions among all."""
        firsts: dict[int, int] = {}
        for i, (net, _, _) in zip(those, places, strict=True):
            firsts.setdefault(id(net), i)
        counts = {id(net): net.u.count * net.v.count for net, _, _ in places}
        begins = dict(zip(firsts, np.cumsum([0, *(counts[each] for each in firsts)]).tolist(), strict=False))
        orders, net = range(derivatives + 1), places[0][0]
        first_u, in_u = zip(*(jet(net.u, uv[:, 0], orders, side[0]) for net, uv, side in places), strict=True)
        first_v, in_v = zip(*(jet(net.v, uv[:, 1], orders, side[1]) for net, uv, side in places), strict=True)
        layout = np.array([(begins[id(net)], net.u.count, net.v.count) for net, _, _ in places])
        begin, count_u, count_v = np.repeat(layout, [len(uv) for _, uv, _ in places], axis=0).T[..., None]
        row = (np.concatenate(first_u)[:, None] + np.arange(net.u.degree + 1)) % count_u
        column = (np.concatenate(first_v)[:, None] + np.arange(net.v.degree + 1)) % count_v
        rows, functions = begin + row * count_v, (np.concatenate(in_u), np.concatenate(in_v))
        return cls(at, list(firsts.values()), rows, column, *functions)

    def evaluate(self, nets: Sequence[Net]) -> tuple[Array, ...]:
        """Points and derivatives, given the surfaces of all places."""
        own = [nets[i] for i in self.firsts]
        poles = [(each := homogeneous(net.poles, net.weights)).reshape(-1, each.shape[-1]) for net in own]
        places, functions = (self.rows, self.columns), (self.in_u, self.in_v)
        return evaluated(np.concatenate(poles), places, functions, own[0].weights is not None)
