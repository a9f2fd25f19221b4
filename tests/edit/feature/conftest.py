"""A bump in a file."""

import pytest

from mracad.edit.feature.detail import save
from mracad.edit.feature.extract import feature_of
from mracad.spec.steps import Single
from tests.edit.feature import grounds
from tests.edit.models import sheet

WINDOW = "near:50,50,0,radius:20"


@pytest.fixture(scope="session")
def feature(tmp_path_factory):
    """The path of a bump, taken from a plane."""
    path = tmp_path_factory.mktemp("feature") / "bump.feature"
    path.write_bytes(save(feature_of(sheet(grounds.plane()), Single(feature=WINDOW), {0}, WINDOW)))
    return str(path)
