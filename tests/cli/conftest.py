"""Small models, made once, and commands that take little time over how things look."""

from pathlib import Path
from typing import Any

import pytest
from mracad_cli.render import plot

from mracad.spec import pictures
from tests.cli import declared


@pytest.fixture(scope="session")
def small(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Two sewn patches, one with a hole, a slab, and two products."""
    return declared.small_models(tmp_path_factory.mktemp("small"))


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """A batch in this process, small pictures, plots without a search for their layout, and few ladders."""
    size_of, packed = pictures.size_of, plot._packed

    def plain(figure: Any, form: str) -> bytes:
        figure.set_layout_engine("none")
        return packed(figure, form)

    for name, value in (
        ("job.batch.pool.Pool", declared.Here),
        ("report.figures.SIZE", "96x64"),
        ("report.figures.PAIR", "96x64"),
        ("report.figures.ALONE", {}),
        ("report.shades.SAMPLES", 100),
        ("view.picture.size_of", lambda text: tuple(min(side, 120) for side in size_of(text))),
        ("wavelet.shrink.FEW", 1),
        ("wavelet.shrink.SPINS", 1),
    ):
        monkeypatch.setattr(f"mracad.{name}", value)
    monkeypatch.setattr(plot, "_packed", plain)
