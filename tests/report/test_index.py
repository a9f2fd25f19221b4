"""The index of a batch: a row for each file that leads to its page, with the numbers of its outcome; names are text."""

import json
import pickle
from concurrent.futures import Future
from pathlib import Path
from urllib.parse import unquote

import numpy as np
import pytest
from mracad_cli.render.batch import Pages, index

import mracad as package
from mracad.job.batch.find import find
from mracad.job.batch.manifest import Manifest
from mracad.job.batch.run import run
from mracad.job.batch.settings import Settings
from mracad.spec.recipe import pipeline
from tests.occ import shapes
from tests.report.browser import CHROMIUM, Browser
from tests.report.conftest import HOSTILE
from tests.report.test_page import Read

NAMES = ["a.step", "<script>alert(1)<script>#1%20.step", "torn.step", "junk.step"]
RECIPE = pipeline("smooth --scale 20% ! check --fail-on unsewn")


class Here:
    """Workers that are this process; tasks come as over a wire."""

    workers = 1

    def submit(self, function, /, *given):
        future = Future()
        try:
            future.set_result(function(*pickle.loads(pickle.dumps(given))))
        except package.MracadError as error:
            future.set_exception(error)
        return future


@pytest.fixture(scope="module")
def batched(tmp_path_factory):
    """The folder of a batch, and its outcomes."""
    folder = tmp_path_factory.mktemp("batched")
    (folder / "in").mkdir()
    with pytest.MonkeyPatch.context() as patch:
        for name in ("SIZE", "PAIR"):
            patch.setattr(f"mracad.report.figures.{name}", "96x64")
        patch.setattr("mracad.report.shades.SAMPLES", 5000)
        face = shapes.face_on(shapes.bspline(shapes.wavy_poles(14, 12)))
        package.write(shapes.document(face, names={0: HOSTILE}), folder / "in" / NAMES[0])
        (folder / "in" / NAMES[1]).write_bytes((folder / "in" / NAMES[0]).read_bytes())
        package.write(shapes.document(*halves()), folder / "in" / NAMES[2])
        (folder / "in" / NAMES[3]).write_text(HOSTILE)
        yield folder, again(folder)


def halves():
    """Two faces that meet and are not sewn."""
    x, y = np.meshgrid(np.linspace(0, 10, 7), np.linspace(0, 10, 7), indexing="ij")
    return [shapes.face_on(shapes.bspline(np.stack([x + far, y, 0.01 * (x + far) * y], axis=-1))) for far in (0, 10)]


def again(folder):
    """Do what is not done yet, and write the index."""
    pages, items = Pages.beside(str(folder / "all.html")), find([str(folder / "in")], folder / "out")
    with Manifest(folder / "out") as manifest:
        outcomes = list(run(RECIPE, items, manifest, Here(), Settings(), pages))
    (folder / "all.html").write_bytes(index("<b>", ["1. smooth"], outcomes, ["line"], folder))
    return {Path(outcome.file).name: outcome for outcome in outcomes}


def rows(folder):
    """The cells of the index by file, and what leads where."""
    read = Read((folder / "all.html").read_text(encoding="utf-8"))
    table = read.tables["files"]
    found = [dict(zip(table["keys"], row, strict=True)) for row in table["rows"] if row]
    return read, {Path(row["file"][1]).name: row for row in found}


def test_a_row_holds_the_numbers_of_its_outcome(batched):
    folder, outcomes = batched
    _, found = rows(folder)
    assert set(found) == set(NAMES) == set(outcomes)
    for name, outcome in outcomes.items():
        row = found[name]
        assert row["status"][1] == outcome.status and json.loads(row["code"][0]) == outcome.code
        assert row["message"][1] == "; ".join(filter(None, [outcome.message, outcome.hint])) or "–"
        if outcome.steps:
            for key in ("edited", "faces", "deviation"):
                assert json.loads(row[key][0]) == outcome.steps[0][key], (name, key)
    assert [outcomes[name].status for name in NAMES] == ["done", "done", "failed", "failed"]
    assert outcomes["torn.step"].code == 1 and outcomes["junk.step"].code == 3
    assert set(list(found)[:2]) == {"junk.step", "torn.step"}, "what failed comes first"


def test_rows_lead_to_pages_also_of_what_failed_a_check(batched):
    folder, outcomes = batched
    read, _ = rows(folder)
    links = [each for each in read.addresses if not each.startswith("data:")]
    pages = {folder / unquote(each) for each in links}
    assert pages == {folder / "all_files" / f"{name}.html" for name in NAMES[:3]}
    assert all(page.is_file() for page in pages)
    assert "check: failed" in " ".join(Read((folder / "all_files/torn.step.html").read_text("utf-8")).texts)
    assert not (folder / "out" / "torn.step").exists() and outcomes["junk.step"].page == ""
    assert sum(each.startswith("data:image/jpeg") for each in read.addresses) == 2 * 3


def test_names_of_files_and_products_are_text(batched):
    folder, _ = batched
    text = (folder / "all.html").read_text(encoding="utf-8")
    read, _ = rows(folder)
    assert text.count("<script") == len(read.scripts) == 1 and "<b>" not in text
    assert any(NAMES[1] in each for each in read.texts)
    page = (folder / "all_files" / f"{NAMES[1]}.html").read_text(encoding="utf-8")
    assert HOSTILE not in page and NAMES[1] not in page and any(NAMES[1] in each for each in Read(page).texts)


def test_what_is_unchanged_keeps_its_row(batched):
    folder, outcomes = batched
    _, before = rows(folder)
    later = again(folder)
    assert [later[name].status for name in NAMES] == ["unchanged", "unchanged", "failed", "failed"]
    _, after = rows(folder)
    for name in NAMES[:2]:
        for key in ("edited", "deviation", "valid"):
            assert after[name][key] == before[name][key]
    assert later["a.step"].page == outcomes["a.step"].page


@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium on this machine")
def test_an_index_in_a_browser(batched, tmp_path):
    folder, _ = batched
    with Browser(tmp_path) as browser:
        browser.open(folder / "all.html", "document.readyState === 'complete'")
        assert browser.ask("[...document.images].every((each) => each.loading === 'lazy')")
        browser.ask("document.querySelector('th[data-k=deviation] button').click()")
        shown = "[...document.querySelectorAll('#files tbody tr')].filter((row) => !row.hidden)"
        found = browser.ask(f"{shown}.map((row) => Number(row.cells[7].dataset.v ?? 1e9))")
        assert found == sorted(found)
        field = "document.querySelector('input[data-for=files]')"
        browser.ask(f"{field}.value = 'failed TORN'; {field}.dispatchEvent(new Event('input'))")
        assert browser.ask(f"{shown}.map((row) => row.cells[1].textContent.split('/').pop())") == [NAMES[2]]
        browser.ask(f"{field}.value = '<script>'; {field}.dispatchEvent(new Event('input'))")
        browser.ask(f"{shown}[0].cells[1].querySelector('a').click()")
        browser.wait(lambda: browser.ask("document.querySelector('#stage.live canvas') !== null"))
        assert NAMES[1] in browser.ask("document.querySelector('h1').textContent")
        assert browser.ask("document.querySelector('.bar').hidden")
        plain = browser.seen("canvas")
        browser.ask("document.querySelector('[data-show=deviation]').click()")
        browser.wait(lambda: not browser.ask("document.querySelector('.bar').hidden"))
        mapped = browser.seen("canvas")
        assert (np.ptp(mapped, axis=2) > 60).mean() > 0.02 > (np.ptp(plain, axis=2) > 60).mean(), "red and blue"
        browser.ask("document.querySelector('[data-show=shaded]').click()")
        assert np.abs(browser.seen("canvas") - plain).max() <= 1
        assert browser.complaints() == []
