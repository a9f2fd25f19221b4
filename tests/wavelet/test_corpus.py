"""Every NURBS face of the real models: reconstruction, and covariance of the projection."""

import numpy as np

from mracad.occ.step import read_step
from mracad.occ.view import view
from mracad.wavelet.ladder import arc_lengths, ladder_for_scale, rungs_by_level
from mracad.wavelet.project import projection
from mracad.wavelet.transform import decompose, reconstruct
from tests.edit.models import rotation


def test_every_face_comes_back(corpus_file):
    worst = 0.0
    for surface in view(read_step(corpus_file)).surfaces:
        net = surface.net
        ladders = [rungs_by_level(k, lengths=arc_lengths(net, i)) for i, k in enumerate((net.u, net.v))]
        again = reconstruct(decompose(net.poles, *ladders))
        size = np.abs(net.poles - net.poles.mean(axis=(0, 1))).max()
        worst = max(worst, float(np.abs(again - net.poles).max() / size))
    print(f"{corpus_file.name}: reconstruction {worst:.1e} of the face's size")
    assert worst <= 1e-12


def test_smoothing_commutes_with_motion_and_scaling(corpus_file):
    model = view(read_step(corpus_file))
    turn, shift = rotation([3, -1, 2], 1.1), np.array([0.7, -0.4, 0.2]) * model.diagonal
    worst = 0.0
    for surface in model.surfaces:
        net = surface.net
        coarse = [ladder_for_scale(k, arc_lengths(net, i), 0.05 * model.diagonal) for i, k in enumerate((net.u, net.v))]
        if coarse == [net.u, net.v]:
            continue

        def smooth(poles, coarse=coarse, net=net):
            return projection(coarse[1], net.v).apply(projection(coarse[0], net.u).apply(poles, 0), 1)

        plain = smooth(net.poles)
        errors = (
            smooth(net.poles + shift) - shift - plain,
            smooth(net.poles @ turn.T) - plain @ turn.T,
            smooth(net.poles * 25.4) / 25.4 - plain,
        )
        worst = max(worst, *(float(np.abs(e).max()) for e in errors))
    print(f"{corpus_file.name}: covariance {worst / model.diagonal:.1e} of the model's size")
    assert worst <= 1e-9 * model.diagonal
