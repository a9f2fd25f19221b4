"""Seams that move with both their faces: error beside the unsplit surface's, and the joints in the file."""

import numpy as np
import pytest

from mracad.audit.continuity import seams
from mracad.edit.smooth import smooth
from mracad.occ.apply import apply
from mracad.occ.check import check
from mracad.occ.step import read_step, write_step
from mracad.occ.view import view
from mracad.options import Smooth
from mracad.wavelet.ladder import ladder_for_scale
from mracad.wavelet.project import projection
from tests.edit import panels

SCALE = 12.0


def unsplit(noisy, clean, patches, scale):
    """Error of the projection of the unsplit surface, its ladder keeping the seam knots."""
    net = noisy
    for axis, count in enumerate(patches):
        knots = (net.u, net.v)[axis]
        keep = frozenset(panels.SIZE * k for k in range(1, count))
        coarse = ladder_for_scale(knots, np.diff(knots.breaks), scale, keep=keep)
        poles = projection(coarse, knots).apply(net.poles, axis)
        net = type(net)(net.u, net.v, poles)
    return panels.rms({k: _whole(net) for k in panels.cut(noisy, patches)}, panels.cut(noisy, patches), clean)


class _whole:
    """The unsplit net under the parameters of any patch."""

    def __init__(self, net):
        self.net = net

    def evaluate(self, places):
        return self.net.evaluate(places)


def through_the_file(patches, tmp_path, **options):
    """Smooth a document of patches, write it, read it back: nets by patch, seams before and after, validity."""
    document = panels.document(patches)
    write_step(document, tmp_path / "in.step")
    document = read_step(tmp_path / "in.step")
    model = view(document)
    edit = smooth(model, Smooth(**options))
    apply(document, model, edit.displacement)
    write_step(document, tmp_path / "out.step")
    again = read_step(tmp_path / "out.step")
    result = view(again)
    nets = {key: result.surfaces[face.surface].net for key, face in zip(sorted(patches), result.faces, strict=True)}
    return nets, seams(model), seams(result), check(again), edit


@pytest.mark.parametrize(
    ("patches", "keep", "ratio"),
    [((2, 3), "g1", 1.15), ((4, 4), "g1", 1.3), ((4, 4), "g2", 1.15)],
)
def test_coupled_panels_are_nearly_as_good_as_unsplit(tmp_path, patches, keep, ratio):
    clean, noisy = panels.whole(32, 0.05, patches=patches)
    pieces = panels.cut(noisy, patches)
    reference = unsplit(noisy, clean, patches, SCALE)
    figures = {}
    for edges in ("coupled", "frozen"):
        nets, _, after, valid, edit = through_the_file(pieces, tmp_path, scale=f"{SCALE}mm", edges=edges, keep=keep)
        assert valid.valid
        figures[edges] = panels.rms(nets, pieces, clean) / reference
        if edges == "coupled":
            assert all(t.how == "coupled" for t in edit.edges if len(t.faces) == 2)
            assert max(m.gap for m in after) <= 1e-9
            assert max(m.angle for m in after) <= 1e-5
    print(f"{patches} {keep}: coupled {figures['coupled']:.3f}, frozen {figures['frozen']:.3f} of the unsplit error")
    assert figures["coupled"] <= ratio
    assert figures["coupled"] < figures["frozen"]


@pytest.mark.parametrize("change", ["knots", "reversed", "degree"])
def test_seams_between_unlike_patches_move_exactly(tmp_path, change):
    clean, noisy = panels.whole(24, 0.05, patches=(2, 2))
    pieces = panels.cut(noisy, (2, 2))
    if change == "knots":
        pieces[0, 1] = panels.refined(pieces[0, 1], u_knots=[11.1, 33.3, 77.7], v_knots=[150.5])
    elif change == "reversed":
        pieces[1, 0] = panels.turned(pieces[1, 0], "u")
        pieces[0, 1] = panels.turned(pieces[0, 1], "vx")
    else:
        net = panels.elevated(pieces[1, 1].net, 0)
        pieces[1, 1] = type(pieces[1, 1])(net, "", pieces[1, 1].frame)
    nets, before, after, valid, edit = through_the_file(pieces, tmp_path, scale=f"{SCALE}mm", edges="coupled")
    assert valid.valid
    moved = [t for t in edit.edges if t.how == "coupled" and len(t.faces) == 2]
    print(change, [(t.how, t.reason, t.freedom) for t in edit.edges if len(t.faces) == 2])
    assert moved
    assert max(m.gap for m in after) <= max(1e-9, max(m.gap for m in before) + 1e-9)
    assert max(m.angle for m in after) <= max(1e-5, max(m.angle for m in before) + 1e-5)
    frozen, *_ = through_the_file(pieces, tmp_path, scale=f"{SCALE}mm", edges="frozen")
    assert panels.rms(nets, pieces, clean) < panels.rms(frozen, pieces, clean)
