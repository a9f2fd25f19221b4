"""Seams along trim curves that move to the tolerance."""

import io

import numpy as np
import pytest
from OCP.BRep import BRep_Tool
from OCP.TopExp import TopExp

from mracad.edit.smooth import smooth
from mracad.inspect.seams import seams
from mracad.job.document import run
from mracad.occ.step import read_step, write_step
from mracad.occ.view import view
from mracad.seam.cause import Cause, Still
from mracad.spec.steps import Smooth
from tests.edit import halves
from tests.edit.models import sheet

NOISE, SPANS = 0.05, (30, 60)


def smoothed(left, right, sewn=True, **options):
    """The document's models before and after smoothing (read again from a file), and the report."""
    document = halves.document(left, right, sewn)
    report = run(document, smooth, Smooth(scale="30mm", **options))
    stream = io.BytesIO()
    write_step(document, stream)
    return report.model, view(read_step(io.BytesIO(stream.getvalue()))), report


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


@pytest.fixture(scope="module")
def rough_halves():
    return halves.surfaces(NOISE, SPANS)


def test_a_trimmed_seam_moves_and_holds(rough_halves):
    """Nearer to the truth than with the seam held; the left half's surface, which goes on beyond it, is the measure."""
    clean, left, right = rough_halves
    model = sheet(left)
    unsplit = smooth(model, Smooth(scale="30mm")).displacement.applied(model).surfaces[0].net
    errors = {"unsplit": error([unsplit] * 2, clean, (0.0, 0.0))}
    for edges in ("frozen", "coupled"):
        before, after, report = smoothed(left, right, edges=edges)
        (old, line), (new, moved) = seam(before), seam(after)
        errors[edges] = error([surface.net for surface in after.surfaces], clean)
        assert report.valid_after.valid
        assert new.gap <= max(old.gap, 1e-4) + 1e-6 and new.angle <= old.angle + 0.008
        assert treatment(report) == (("to tolerance", None) if edges == "coupled" else ("frozen", Cause(Still.FROZEN)))
        assert (np.linalg.norm(line - moved, axis=1).max() > NOISE / 4) == (edges == "coupled")
    print("rms beside the seam, mm:", {k: round(x, 4) for k, x in errors.items()})
    assert errors["coupled"] <= 1.05 * errors["unsplit"] and errors["coupled"] < 0.9 * errors["frozen"]


def test_a_model_that_was_never_sewn_moves_like_a_sewn_one(rough_halves):
    """Within a seventh of what moves: the conditions along two trim curves are not those along one."""
    _, left, right = rough_halves
    y, moved = np.linspace(10, 190, 200), []
    for sewn in (True, False):
        before, after, report = smoothed(left, right, sewn)
        (old, _), (new, _) = seam(before), seam(after)
        assert old.sewn is sewn
        assert sum(t.how == "to tolerance" for t in report.edit.edges) == 2 - sewn
        assert old.gap < 1e-3 and new.gap <= 1e-4 and new.angle <= old.angle + 0.008
        moved.append(after.surfaces[0].net.evaluate(np.stack([halves.waist(y) - 1.0, y], axis=1))[:, 2])
    still = left.evaluate(np.stack([halves.waist(y) - 1.0, y], axis=1))[:, 2]
    assert np.abs(moved[1] - moved[0]).max() < 0.14 * np.abs(moved[0] - still).max()


@pytest.mark.parametrize("keep", ["g1", "g2"])
def test_a_seam_beside_a_face_with_nothing_to_smooth_stays(keep):
    before, after, report = smoothed(*halves.quiet(NOISE, (10, 20)), keep=keep)
    (old, _), (new, _) = seam(before), seam(after)
    assert treatment(report) == ("frozen", Cause(Still.NEIGHBOUR))
    assert [outcome.status for outcome in report.edit.outcomes] == ["edited", "unchanged"]
    assert old.gap < 1e-9 and new.gap <= 1e-4 and new.angle <= 0.008
    if keep == "g2":
        assert new.bend - old.bend <= 1e-3 / 30


def test_gaps_and_tilts_are_pulled_shut_where_asked():
    _, left, right = halves.surfaces(NOISE, (15, 30))
    before, after, report = smoothed(left, right, close_gaps=True, fit_g1=0.5)
    (old, _), (new, _) = seam(before), seam(after)
    assert treatment(report) == ("mended", None)
    assert new.mean_gap < 0.3 * old.mean_gap and new.mean_angle < 0.5 * old.mean_angle


def test_vertices_stay_where_the_ends_of_their_edges_do(rough_halves):
    document = halves.document(*rough_halves[1:], beside=1e-3)
    edge = next(edge.index for edge in view(document).edges if len(edge.sides) == 2)
    vertices = [end(document.edges[edge]) for end in (TopExp.FirstVertex_s, TopExp.LastVertex_s)]
    before = [BRep_Tool.Pnt_s(vertex) for vertex in vertices]
    report = run(document, smooth, Smooth(scale="30mm"))
    assert treatment(report) == ("to tolerance", None)
    assert all(old.Distance(BRep_Tool.Pnt_s(vertex)) < 1e-9 for old, vertex in zip(before, vertices, strict=True))
