"""One file of a batch: what another one left behind is forgotten."""

from mracad.bspline.knots import KnotVector
from mracad.job.batch.settings import Settings
from mracad.job.batch.work import Work, do
from mracad.memo import kept
from mracad.spec.pictures import Scalars
from mracad.spec.recipe import pipeline
from tests.occ.shapes import bspline, face_on, save, wavy_poles


@kept(4)
def remembered(knots: KnotVector) -> list[int]:
    return []


def test_what_was_kept_of_another_file_is_forgotten(samples):
    first = remembered(KnotVector.clamped([0, 1], 1))
    assert remembered(KnotVector.clamped([0, 1], 1)) is first
    data = (samples / "trimmed.step").read_bytes()
    do(Work("trimmed.step", data, pipeline("check").steps("trimmed.step"), Settings(verify=False)))
    assert remembered(KnotVector.clamped([0, 1], 1)) is not first


def test_meshes_get_numbers_by_files_that_travel_with_the_work(tmp_path):
    data = save(face_on(bspline(wavy_poles(6, 5))), tmp_path / "a.step").read_bytes()
    steps, far = pipeline("check").steps("a.step"), "/far/ref.step"

    def work(scalar: tuple[str, ...], format: str = "ply") -> Work:
        settings = Settings(chord="1mm", scalars=Scalars(scalar=scalar))
        return Work("a.step", data, steps, settings, format, {far: data})

    painted, bare = work((f"deviation:{far}",)), work(())
    assert b"deviation" in do(painted).data and b"deviation" not in do(bare).data
    assert painted.key != bare.key and work((f"deviation:{far}",), "step").key == work((), "step").key
