"""Reports in a browser: no complaint, no request, the model turns, tables sort and filter."""

import numpy as np
import pytest

import mracad
from tests.report.browser import CHROMIUM, Browser

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium on this machine")

LIVE = "document.querySelector('#stage.live canvas') !== null"


@pytest.fixture(scope="module")
def page(made, tmp_path_factory):
    with Browser(tmp_path_factory.mktemp("browser")) as browser:
        browser.open(made.page, LIVE)
        yield browser


def changed(one, two):
    return (np.abs(one - two).max(axis=2) > 12).mean()


def column(page, table, number):
    rows = f"[...document.querySelectorAll('#{table} tbody tr')].filter((row) => !row.hidden)"
    return page.ask(f"{rows}.map((row) => row.cells[{number}].textContent)")


def test_the_model_turns_and_moves_and_nothing_is_fetched(page):
    first = page.seen("canvas")
    assert (first < 250).any(axis=2).mean() > 0.1, "the model is seen"
    assert changed(first, page.seen("canvas")) == 0.0
    page.drag("canvas", (120, 40))
    turned = page.seen("canvas")
    assert changed(first, turned) > 0.05
    page.drag("canvas", (90, 0), "right")
    moved = page.seen("canvas")
    assert changed(turned[:, :-90], moved[:, 90:]) < 0.01 < changed(turned, moved)
    page.ask("document.querySelector('[data-view=\"1,-1,1\"]').click()")
    assert changed(first, page.seen("canvas")) < 1e-3, "a view brings it back"
    assert page.complaints() == []
    assert {each.partition(":")[0] for each in page.requests()} <= {"file", "data", "blob"}


def test_the_wheel_zooms_about_the_pointer(page):
    page.ask("document.querySelector('[data-view=\"0,0,1\"]').click()")
    before = (page.seen("canvas") < 250).any(axis=2).mean()
    x, y, wide, tall = page.box("canvas")
    place = {"x": x + wide / 2, "y": y + tall / 2}
    page.do("Input.dispatchMouseEvent", type="mouseWheel", deltaX=0, deltaY=300, **place)
    after = (page.seen("canvas") < 250).any(axis=2).mean()
    assert after == pytest.approx(before * np.exp(-2 * 0.0015 * 300), rel=0.05), "areas go with the square"


def test_a_view_fits_the_model_into_the_picture(page):
    for view in ("1,-1,1", "0,0,1", "1,0,0"):
        page.ask(f"document.querySelector('[data-view=\"{view}\"]').click()")
        seen = (page.seen("canvas")[2:-2, 2:-2] < 250).any(axis=2)
        shares = []
        for axis in (0, 1):
            hit = np.flatnonzero(seen.any(axis=axis))
            assert abs(hit[0] + hit[-1] - len(seen.any(axis=axis)) + 1) <= 3, "it is in the middle"
            shares.append((hit[-1] - hit[0]) / len(seen.any(axis=axis)))
        assert max(shares) == pytest.approx(1 / 1.08, abs=0.01)


def test_zebra_and_edges_are_shown_as_asked(page):
    page.ask("document.querySelector('[data-view=\"1,-1,1\"]').click()")
    shaded = page.seen("canvas")
    page.ask("document.querySelector('[data-show=zebra]').click()")
    striped = page.seen("canvas")
    assert changed(shaded, striped) > 0.1
    page.ask("document.querySelector('[data-edges]').click()")
    assert 1e-4 < changed(striped, page.seen("canvas")) < 0.1
    page.ask("document.querySelector('[data-edges]').click(); document.querySelector('[data-show=shaded]').click()")


def test_a_click_tells_the_face(page, made):
    page.ask("document.querySelector('[data-view=\"0,0,1\"]').click()")
    page.drag("canvas", (0, 0))
    told = page.ask("document.querySelector('#stage output').textContent")
    number = int(told[1:].split()[0])
    kinds = {face["face"]: face["kind"] for face in made.body["faces"]}
    assert told.startswith(f"#{number} {kinds[number]}")
    assert page.ask("document.querySelector('#faces tr.chosen td').textContent") == f"#{number}"


def test_tables_sort_by_a_click_on_the_header(page, made):
    area = "document.querySelector('#faces th[data-k=area] button').click()"
    areas = {f"#{face['face']}": face["area"] for face in made.body["faces"]}
    for backwards in (False, True):
        page.ask(area)
        found = [areas[number] for number in column(page, "faces", 0)]
        assert found == sorted(areas.values(), reverse=backwards)
    assert page.ask("document.querySelector('#faces th[data-k=area]').ariaSort") == "descending"


def test_tables_filter_by_words(page, made):
    field = "document.querySelector('input[data-for=faces]')"
    page.ask(f"{field}.value = 'PLANE'; {field}.dispatchEvent(new Event('input'))")
    planes = {f"#{face['face']}" for face in made.body["faces"] if "plane" in face["kind"]}
    assert set(column(page, "faces", 0)) == planes and planes
    page.ask(f"{field}.value = ''; {field}.dispatchEvent(new Event('input'))")
    assert len(column(page, "faces", 0)) == len(made.body["faces"])


def test_paper_gets_the_picture_instead_of_the_model(page):
    page.do("Emulation.setEmulatedMedia", media="print")
    style = "getComputedStyle(document.querySelector('#stage > {}')).display"
    assert page.ask(style.format("canvas")) == "none" and page.ask(style.format("img")) == "block"
    page.do("Emulation.setEmulatedMedia", media="")


def test_names_are_text(page, made):
    shown = page.ask("document.body.innerText")
    assert "<script>alert(1)</script>" in shown and "</script><!--" in shown


def test_a_notebook_shows_the_model_to_turn_apart_from_itself(page, made, tmp_path):
    """The last test: the page is another one then."""
    path = tmp_path / "cell.html"
    path.write_text("<!doctype html><meta charset=utf-8>" + mracad.read(made.model)._repr_html_(), encoding="utf-8")
    page.open(path, "document.querySelector('iframe') !== null")

    def turned():
        before = page.seen("iframe")
        page.drag("iframe", (90, 30))
        return changed(before, page.seen("iframe")) > 0.02

    page.wait(turned)
    assert turned(), "not only the picture has been replaced"
    assert page.ask("document.querySelector('iframe').contentDocument") is None
    assert page.complaints() == []
    assert {each.partition(":")[0] for each in page.requests()} <= {"file", "data", "blob"}
