"""One file of a batch: what another one left behind is forgotten."""

from mracad.bspline.knots import KnotVector
from mracad.job.batch.settings import Settings
from mracad.job.batch.work import Work, do
from mracad.memo import kept
from mracad.spec.recipe import pipeline


@kept(4)
def remembered(knots: KnotVector) -> list[int]:
    return []


def test_what_was_kept_of_another_file_is_forgotten(samples):
    first = remembered(KnotVector.clamped([0, 1], 1))
    assert remembered(KnotVector.clamped([0, 1], 1)) is first
    data = (samples / "trimmed.step").read_bytes()
    do(Work("trimmed.step", data, pipeline("check").steps("trimmed.step"), Settings(verify=False)))
    assert remembered(KnotVector.clamped([0, 1], 1)) is not first
