"""Small models, made once."""

from pathlib import Path

import pytest

from tests.cli import declared


@pytest.fixture(scope="session")
def small(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Two sewn patches, one with a hole, a slab, and two products."""
    return declared.small_models(tmp_path_factory.mktemp("small"))
