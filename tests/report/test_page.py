"""Reports as files: nothing outside is named, numbers are those of the JSON, names are text, the same bytes again."""

import base64
import json
import re
import subprocess
import zlib
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from OCP.BRepPrimAPI import BRepPrimAPI_MakeSphere

from mracad.report.mesh import mesh
from mracad.report.page import Figure, Page, html
from mracad.report.table import MOST, Column, Table
from tests.occ import shapes
from tests.report.conftest import HOSTILE

ROOT = Path(__file__).parents[2]


class Read(HTMLParser):
    """What a parser finds in a page: addresses, scripts, texts, and the tables with their exact values."""

    def __init__(self, text):
        super().__init__(convert_charrefs=True)
        self.addresses, self.scripts, self.texts, self.tables = [], [], [], {}
        self._table, self._script, self._cell = None, None, None
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self.addresses += [
            given[name] for name in ("src", "href", "action", "srcset", "poster", "data") if name in given
        ]
        if tag == "script":
            self._script = (given, [])
            self.scripts.append(self._script)
        elif tag == "table":
            self._table = self.tables.setdefault(given.get("id"), {"keys": [], "rows": []})
        elif tag == "th" and "data-k" in given:
            self._table["keys"].append(given["data-k"])
        elif tag == "tr":
            self._table["rows"].append([])
        elif tag == "td":
            self._cell = [given.get("data-v"), ""]
            self._table["rows"][-1].append(self._cell)

    def handle_endtag(self, tag):
        if tag == "script":
            self._script = None
        if tag == "td":
            self._cell = None

    def handle_data(self, data):
        if self._script:
            self._script[1].append(data)
        else:
            self.texts.append(data)
        if self._cell:
            self._cell[1] += data


@pytest.fixture(scope="module")
def read(made):
    return Read(made.page.read_text(encoding="utf-8"))


def script(read, name):
    return next("".join(texts) for given, texts in read.scripts if given.get("id") == name)


def test_a_page_names_nothing_outside(made, read):
    text = made.page.read_text(encoding="utf-8")
    assert read.addresses and all(each.startswith("data:") for each in read.addresses)
    assert not re.search(r"https?:|//[a-z]+\.[a-z]|@import|url\(", text)
    assert re.findall(r"\bimport\b[^;]*;", re.sub(r"<script type=\"text/plain\".*?</script>", "", text)) == [
        "import(source);"
    ]
    assert "default-src 'none'" in text, "and the browser is told so"


def test_every_number_is_that_of_the_json(made, read):
    sources = {"faces": made.body["faces"], "seams": made.body["seams"]["each"]}
    counted = 0
    for name, records in sources.items():
        table = read.tables[name]
        rows = [row for row in table["rows"] if row]
        assert len(rows) == len(records)
        for row, record in zip(rows, records, strict=True):
            for key, (exact, shown) in zip(table["keys"], row, strict=True):
                value = record.get(key)
                if key in ("detail", "shortest_wavelength") and not record["shortest_wavelength"]:
                    value = None  # a face without waves
                number = isinstance(value, int | float) and not isinstance(value, bool)
                assert (exact is not None) == number, (key, value, shown)
                if number:
                    counted += 1
                    assert json.loads(exact) == value
                    assert float(shown.lstrip("#").replace("−", "-")) == pytest.approx(value, rel=1e-4, abs=1e-9)
    assert counted > 15
    assert {"area", "detail"} <= set(read.tables["faces"]["keys"])
    assert {"gap", "angle", "bend"} <= set(read.tables["seams"]["keys"])


def test_names_are_data(made, read):
    text = made.page.read_text(encoding="utf-8")
    assert HOSTILE in made.body["products"] and HOSTILE not in text
    assert any(HOSTILE in each for each in read.texts)
    assert "</script><!--" in json.dumps(json.loads(script(read, "head")))
    assert [given.get("id") or given.get("type") for given, _ in read.scripts] == [
        "head",
        "mesh",
        "three",
        None,
        "module",
    ]
    assert "\x07" not in text and "\\u0007" in text


def test_the_same_bytes_for_the_same_model(made, mracad, tmp_path):
    assert mracad("report", made.model, "-o", tmp_path / "again.html").code == 0
    assert (tmp_path / "again.html").read_bytes() == made.page.read_bytes()


def unpacked(packed):
    """Points and normals of a mesh."""
    data = zlib.decompress(packed.data)
    count = sum(face[2] for face in packed.head["faces"])
    points = np.frombuffer(data, "<u2", 3 * count).reshape(-1, 3) * packed.head["step"] + packed.head["low"]
    x, y = np.frombuffer(data, "<i2", 2 * count, 6 * count).reshape(-1, 2).T / 32767
    z = 1 - abs(x) - abs(y)
    x, y = (
        np.where(z < 0, (1 - abs(y)) * np.where(x < 0, -1, 1), x),
        np.where(z < 0, (1 - abs(x)) * np.where(y < 0, -1, 1), y),
    )
    normals = np.stack([x, y, z], axis=1)
    return points, normals / np.linalg.norm(normals, axis=1, keepdims=True), data


def test_a_packed_sphere_is_a_sphere():
    packed = mesh(shapes.document(BRepPrimAPI_MakeSphere(10.0).Shape()), {0: "ball"})
    points, normals, data = unpacked(packed)
    assert np.abs(np.linalg.norm(points, axis=1) - 10).max() < 20 / 65535
    assert np.abs(normals - points / 10).max() < 1e-4
    [[number, name, count, triangles, segments]] = packed.head["faces"]
    assert (number, name, triangles) == (1, "ball", packed.triangles)
    assert len(data) == 10 * count + 2 * (3 * triangles + 2 * segments)
    corners = np.frombuffer(data, "<u2", 3 * triangles, 10 * count).reshape(-1, 3)
    volume = np.linalg.det(points[corners]).sum() / 6
    assert volume == pytest.approx(4 / 3 * np.pi * 1000, rel=0.01), "triangles look outward"


def test_large_models_get_coarser_triangles():
    document = shapes.document(BRepPrimAPI_MakeSphere(10.0).Shape())
    fine = mesh(document, {})
    coarse = mesh(document, {}, most=fine.triangles // 2)
    assert coarse.triangles <= fine.triangles // 2 and coarse.chord > fine.chord


def test_a_page_without_a_model_to_turn_says_so():
    document = shapes.document(BRepPrimAPI_MakeSphere(10.0).Shape())
    assert mesh(document, {}, most=1) is None
    page = Page("ball", "Report", (), (), (), Figure("The ball", b"picture"), None)
    found = Read(html(page).decode())
    assert "too many faces to turn" in " ".join(found.texts)
    assert not {given.get("id") for given, _ in found.scripts} & {"head", "mesh", "three"}


def test_long_tables_end_and_say_so():
    table = Table("t", "T", [Column("A", "a.b"), Column("None", "c")], [{"a": {"b": k}} for k in range(MOST + 5)])
    assert len(table.rows) == MOST and table.left_out == 5
    assert [cell.value for cell in table.rows[7]] == [7], "a column without values is not shown"


def test_what_the_page_is_made_of_is_in_the_wheel(tmp_path):
    """Wheels take what git knows or would take."""
    names = ["page.html", "style.css", "tables.js", "model.js", "three.module.min.js", "three.LICENSE"]
    paths = [ROOT / "mracad" / "report" / "data" / name for name in names]
    assert all(path.is_file() for path in paths)
    ignored = subprocess.run(["git", "-C", ROOT, "check-ignore", *paths], capture_output=True, text=True)
    assert ignored.stdout == ""


def test_three_js_is_whole(read):
    source = zlib.decompress(base64.b64decode(script(read, "three"))).decode()
    assert "SPDX-License-Identifier: MIT" in source and "WebGLRenderer" in source
    assert "Permission is hereby granted, free of charge" in "".join(read.texts)
