"""What an edit does to a model: offsets of the control points of its surfaces."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from mracad.bspline.surface import Net
from mracad.model.brep import Model

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class Offset:
    """Pole offsets of one surface, in its own spline space or one that holds it exactly: of higher degree, finer.

    Attributes
    ----------
    poles : ndarray (nu, nv, 3)
        Offsets of the Euclidean control points of the net that ``over`` gives, mm; weights are kept.
        Rows that are exactly zero are left bit-identical.
    u_knots, v_knots : ndarray
        Knots to insert first (with repetition), beyond those the (elevated) surface has; empty for none.
    degrees : (int, int)
        Degrees in u and v to which the surface is elevated before that, unless its own are higher.
    """

    poles: Array
    u_knots: Array = field(default_factory=lambda: np.empty(0))
    v_knots: Array = field(default_factory=lambda: np.empty(0))
    degrees: tuple[int, int] = (0, 0)

    @classmethod
    def of(cls, own: Net, fine: Net, poles: Array) -> Offset:
        """Offsets of the control points of a finer net of a surface."""
        degrees = (fine.u.degree, fine.v.degree)
        u, v = (
            kv.beyond(old.elevated(degree))
            for kv, old, degree in zip((fine.u, fine.v), (own.u, own.v), degrees, strict=True)
        )
        return cls(poles, u, v, degrees)

    def over(self, net: Net) -> Net:
        """The net of the undisplaced surface whose control points the offset moves; ``net`` itself where it does."""
        u, v = (kv.elevated(degree) for kv, degree in zip((net.u, net.v), self.degrees, strict=True))
        return net.over(u.refined(self.u_knots), v.refined(self.v_knots))

    def motion(self, net: Net) -> Net:
        """The displacement of a surface as a net of its own."""
        return self.over(net).with_poles(self.poles)


@dataclass(frozen=True, eq=False)
class Displacement:
    """The result of an edit: offsets of control points by surface index.  Surfaces that are not named do not move."""

    offsets: dict[int, Offset] = field(default_factory=dict)

    def scaled(self, factor: float) -> Displacement:
        """The same displacement times ``factor``."""
        return Displacement({i: replace(o, poles=factor * o.poles) for i, o in self.offsets.items()})

    def applied(self, model: Model) -> Model:
        """The model with its surfaces displaced (baked sides stay where they are)."""
        surfaces = list(model.surfaces)
        for index, offset in self.offsets.items():
            net = offset.over(surfaces[index].net)
            surfaces[index] = replace(surfaces[index], net=net.with_poles(net.poles + offset.poles))
        return model.with_surfaces(surfaces)


def lifted(own: Net, fine: Net, offset: Array) -> Array:
    """Offsets of the control points of a net as those of a finer one of the same surface."""
    return offset if fine is own else own.with_poles(offset).over(fine.u, fine.v).poles
