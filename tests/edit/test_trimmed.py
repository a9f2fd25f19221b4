"""Seams along trim curves that move to the tolerance."""

import io

import numpy as np
import pytest
from OCP.BRep import BRep_Tool
from OCP.TopExp import TopExp

from mracad import job
from mracad.audit.continuity import seams
from mracad.bspline.net import Net
from mracad.edit.smooth import smooth
from mracad.occ.step import read_step, write_step
from mracad.occ.view import view
from mracad.options import Smooth
from mracad.wavelet.ladder import arc_lengths, ladder_for_scale
from mracad.wavelet.project import projection
from tests.edit import halves

NOISE = 0.2


def smoothed(left, right, sewn=True, **options):
    """The document's models before and after smoothing (read again from a file), and the report."""
    document = halves.document(left, right, sewn)
    report = job.run(document, smooth, Smooth(scale="30mm", **options))
    stream = io.BytesIO()
    write_step(document, stream)
    return report.model, view(read_step(io.BytesIO(stream.getvalue()))), report


def ideal(clean, left):
    """The left half's surface, which goes on beyond the seam, smoothed as a whole: how far it is from the truth."""
    u, v = (ladder_for_scale(k, arc_lengths(left, axis), 30.0) for axis, k in enumerate((left.u, left.v)))
    poles = projection(v, left.v).apply(projection(u, left.u).apply(left.poles, 0), 1)
    return error([Net(left.u, left.v, poles)] * 2, clean, (0.0, 0.0))


def seam(model):
    """The measure of the one seam, and points along it."""
    (measure,) = (measure for measure in seams(model) if len(measure.faces) == 2)
    return measure, next(edge.points for edge in model.edges if edge.index == measure.edge)


def error(nets, clean, shears=(0.0, halves.SHEAR)):
    """Root mean square of height over the truth on the strip within 25 mm of the seam, both halves, mm."""
    found = []
    for net, shear, sign in zip(nets, shears, (-1, 1), strict=True):
        y, off = np.meshgrid(np.linspace(15, 185, 80), np.linspace(0.5, 25, 20))
        x = halves.waist(y) + sign * off
        points = net.evaluate(np.stack([(x - shear * y).ravel(), y.ravel()], axis=1))
        found.append(points[:, 2] - clean.evaluate(points[:, :2])[:, 2])
    return float(np.sqrt(np.mean(np.concatenate(found) ** 2)))


def treatment(report):
    """What was done about the seam, and why."""
    return next((t.how, t.reason) for t in report.edit.edges if len(t.faces) == 2)


@pytest.mark.parametrize("spans", [(30, 60), (60, 120)], ids=["coarse", "fine"])
def test_a_trimmed_seam_moves_and_holds(spans):
    clean, left, right = halves.surfaces(NOISE, spans)
    errors = {"ideal": ideal(clean, left), "noise": error((left, right), clean)}
    for how in ("frozen", "g1", "g2"):
        options = {"edges": "frozen"} if how == "frozen" else {"keep": how}
        before, after, report = smoothed(left, right, **options)
        (old, line), (new, moved) = seam(before), seam(after)
        errors[how] = error([surface.net for surface in after.surfaces], clean)
        assert report.valid_after.valid
        assert new.gap <= max(old.gap, 1e-4) + 1e-7 and new.angle <= old.angle + 0.008
        if how != "frozen":
            assert treatment(report) == ("to tolerance", "")
            assert np.linalg.norm(line - moved, axis=1).max() > NOISE / 4
            assert all(t.freedom >= 11 for t in report.edit.edges if t.how == "to tolerance")  # 8 coarse spans
    print("\nrms beside the seam, mm:", {k: round(x, 4) for k, x in errors.items()})
    assert errors["g1"] < min(1.25 * errors["ideal"], 0.8 * errors["frozen"])
    # eight coarse spans leave little that keeps the curvature as well
    assert errors["g2"] < min(1.35 * errors["ideal"], 0.85 * errors["frozen"])


def test_a_model_that_was_never_sewn_moves_like_a_sewn_one():
    left, right = halves.quiet(NOISE, (10, 20))
    y, moved = np.linspace(10, 190, 200), []
    for sewn in (True, False):
        before, after, report = smoothed(left, right, sewn)
        (old, _), (new, _) = seam(before), seam(after)
        assert old.sewn is sewn
        assert sum(t.how == "to tolerance" for t in report.edit.edges) == 2 - sewn
        assert new.gap <= old.gap + 1e-4 and new.angle <= old.angle + 0.008
        moved.append(after.surfaces[0].net.evaluate(np.stack([halves.waist(y) - 1.0, y], axis=1))[:, 2])
    still = left.evaluate(np.stack([halves.waist(y) - 1.0, y], axis=1))[:, 2]
    assert np.abs(moved[1] - moved[0]).max() < 0.05 * np.abs(moved[0] - still).max()


@pytest.mark.parametrize("keep", ["g1", "g2"])
def test_surfaces_that_meet_exactly_stay_together(keep):
    before, after, report = smoothed(*halves.quiet(NOISE, (10, 20)), keep=keep)
    (old, _), (new, _) = seam(before), seam(after)
    assert treatment(report) == ("to tolerance", "") and len(report.edit.faces("edited")) == 2
    assert old.gap < 1e-9 and new.gap <= 1e-4 and new.angle <= 0.008
    if keep == "g2":
        assert new.bend - old.bend <= 1e-3 / 30


def test_spans_under_a_seam_that_stays_open_are_halved(monkeypatch):
    found = {}
    for steeper in (0.008, 2e-6):
        monkeypatch.setattr("mracad.edit.group.STEEPER", np.radians(steeper))
        _, after, report = smoothed(*halves.quiet(NOISE, (4, 6), 20.0), gap_tolerance="1e-6mm")
        assert treatment(report) == ("to tolerance", "")
        found[steeper] = seam(after)[0].angle, sum(surface.net.poles.size for surface in after.surfaces)
        assert found[steeper][0] <= steeper
    assert found[2e-6][1] > found[0.008][1] and found[2e-6][0] < found[0.008][0]


def test_a_seam_that_cannot_hold_stays_and_says_why(monkeypatch):
    monkeypatch.setattr("mracad.edit.group.STEEPER", 1e-12)
    _, left, right = halves.surfaces(NOISE, (30, 60))
    right.poles[..., 2] += 1e-3 * np.random.default_rng(5).standard_normal(right.poles.shape[:2])
    before, _, report = smoothed(left, right)
    assert treatment(report)[0] == "frozen" and treatment(report)[1]
    gaps = [next(m.gap for m in found if m.edge == seam(before)[0].edge) for found in (report.before, report.after)]
    assert gaps[1] == pytest.approx(gaps[0], abs=1e-9)


def test_gaps_and_tilts_are_pulled_shut_where_asked():
    _, left, right = halves.surfaces(NOISE, (30, 60))
    before, after, report = smoothed(left, right, close_gaps=True, fit_g1=0.5)
    (old, _), (new, _) = seam(before), seam(after)
    assert treatment(report) == ("mended", "")
    assert new.mean_gap < 0.3 * old.mean_gap and new.mean_angle < 0.5 * old.mean_angle


def test_vertices_stay_where_the_ends_of_their_edges_do():
    document = halves.document(*halves.quiet(NOISE, (10, 20)), beside=1e-3)
    edge = next(edge.index for edge in view(document).edges if len(edge.sides) == 2)
    vertices = [end(document.edges[edge]) for end in (TopExp.FirstVertex_s, TopExp.LastVertex_s)]
    before = [BRep_Tool.Pnt_s(vertex) for vertex in vertices]
    report = job.run(document, smooth, Smooth(scale="30mm"))
    assert treatment(report) == ("to tolerance", "")
    assert all(old.Distance(BRep_Tool.Pnt_s(vertex)) < 1e-9 for old, vertex in zip(before, vertices, strict=True))
