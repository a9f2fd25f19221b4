"""Outlines: flat tops, flanks by the distance from curves, rules of filling, units; files without outlines."""

import re

import ezdxf
import numpy as np
import pytest

from mracad.edit.feature.source import made
from mracad.edit.feature.source.outline import BEND
from mracad.errors import Code, FileError
from mracad.spec.sources import source

HEIGHT, EDGE = 0.4, 0.3
WIDTH = np.sqrt(BEND * HEIGHT * EDGE)


def build(path, text=f"height:{HEIGHT}mm,edge:{EDGE}mm"):
    text = f"{path},{text}"
    return made(source(text, "feature"), text)


def svg(path, body, size='width="40mm" height="40mm" viewBox="0 0 40 40"', more=""):
    path.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" {more} {size}>{body}</svg>')
    return path


def at(feature, *points):
    return feature.lookup(np.array(points, float))[:, 2] / HEIGHT


def profile(distance, width=WIDTH):
    t = np.clip(0.5 + distance / width, 0, 1)
    return t**3 * (10 - 15 * t + 6 * t * t)


RING = (
    '<path fill-rule="{rule}" d="M0 20 A20 20 0 1 {a} 40 20 A20 20 0 1 {a} 0 20 Z '
    'M10 20 A10 10 0 1 0 30 20 A10 10 0 1 0 10 20 Z"/>'
)


def test_a_disc_has_a_flat_top_and_flanks_by_the_distance_from_its_rim(tmp_path):
    feature = build(svg(tmp_path / "disc.svg", '<circle cx="20" cy="20" r="12"/>'))
    r = np.linspace(0, 13.5, 400)
    for angle in np.linspace(0, 6, 11):
        found = feature.lookup(np.stack([r * np.cos(angle), r * np.sin(angle)], axis=1))[:, 2]
        assert np.abs(found / HEIGHT - profile(12 - r)).max() < 0.025
        assert np.abs(found[r < 12 - 0.75 * WIDTH] - HEIGHT).max() < 1e-4 * HEIGHT
        assert np.abs(found[r > 12 + 0.75 * WIDTH]).max() < 1e-4 * HEIGHT
    bend = np.gradient(np.gradient(found, r), r)
    assert np.abs(bend).max() == pytest.approx(1 / EDGE, rel=0.2)
    assert WIDTH / 12 < feature.spacing < WIDTH / 3


@pytest.mark.parametrize(
    ("rule", "sense", "hole"), [("evenodd", 0, True), ("evenodd", 1, True), ("nonzero", 0, False), ("nonzero", 1, True)]
)
def test_rules_of_filling_decide_on_holes(tmp_path, rule, sense, hole):
    feature = build(svg(tmp_path / "ring.svg", RING.format(rule=rule, a=sense)))
    found = at(feature, (0, 0), (10, 0), (15, 0))
    assert found[1] == pytest.approx(0.5 if hole else 1.0, abs=0.02)
    assert found[0] == pytest.approx(0.0 if hole else 1.0, abs=1e-3) and found[2] == pytest.approx(1, abs=1e-3)


def test_overlapping_shapes_are_one_and_islands_stay(tmp_path):
    body = (
        '<defs><rect id="hidden" width="40" height="40"/></defs>'
        '<g transform="translate(10 0)"><rect x="0" y="0" width="12" height="10"/></g>'
        '<rect x="18" y="0" width="14" height="10"/><circle cx="20" cy="30" r="4"/>'
        '<rect width="40" height="40" fill="none"/><rect width="40" height="40" style="display:none"/>'
    )
    feature = build(svg(tmp_path / "two.svg", body))
    middle = np.array([21.0, 17.0])  # of x 10 to 32, y 0 to 34
    place = lambda x, y: (x - middle[0], middle[1] - y)  # noqa: E731
    found = at(feature, place(20, 5), place(22, 5), place(18, 5), place(20, 30), place(20, 18), place(10, 5))
    assert found == pytest.approx([1, 1, 1, 1, 0, 0.5], abs=0.02)


def test_units_of_svg_and_dxf_and_a_width(tmp_path):
    inch = svg(tmp_path / "inch.svg", '<circle cx="1" cy="1" r="1"/>', 'width="2in" height="2in" viewBox="0 0 2 2"')
    for feature, radius in ((build(inch), 25.4), (build(inch, f"height:{HEIGHT},edge:{EDGE},width:30mm"), 15.0)):
        found = at(feature, (radius, 0.0), (radius - WIDTH / 4, 0.0))
        assert found == pytest.approx([0.5, profile(WIDTH / 4)], abs=0.03)
    document = ezdxf.new(units=1)  # inches
    document.modelspace().add_circle((3, 3), 0.5)
    document.saveas(tmp_path / "inch.dxf")
    assert at(build(tmp_path / "inch.dxf"), (12.7, 0.0), (0.0, 0.0)) == pytest.approx([0.5, 1.0], abs=0.02)


def test_a_dxf_without_a_unit_is_in_mm_and_a_note_says_so(tmp_path):
    found = {}
    for unit in (0, 4):
        document = ezdxf.new(units=unit)
        document.modelspace().add_circle((3, 3), 10)
        document.saveas(tmp_path / f"{unit}.dxf")
        found[unit] = build(tmp_path / f"{unit}.dxf")
    assert np.array_equal(found[0].table, found[4].table)
    assert [any("states no unit" in note for note in found[unit].notes) for unit in (0, 4)] == [True, False]
    scaled = build(tmp_path / "0.dxf", f"height:{HEIGHT},edge:{EDGE},width:30mm")
    assert not any("states no unit" in note for note in scaled.notes)


def test_a_note_gives_the_sides_with_the_flanks(tmp_path):
    feature = build(svg(tmp_path / "bar.svg", '<rect width="30" height="10"/>'))
    sides = re.search(r"with its flanks it is (\S+) × (\S+) mm, (\S+) mm from corner to corner", feature.notes[-1])
    wide, deep, across = map(float, sides.groups())
    assert wide == pytest.approx(30 + 2 * WIDTH, abs=0.2) and deep == pytest.approx(10 + 2 * WIDTH, abs=0.2)
    assert across == pytest.approx(np.hypot(wide, deep), abs=0.1)


def test_lines_and_arcs_of_dxf_are_joined_and_holes_stay_open(tmp_path):
    document = ezdxf.new(units=4)
    space = document.modelspace()
    space.add_line((-10, -5), (10, -5))
    space.add_line((10, 5), (10, -5))
    space.add_line((10, 5), (-10, 5))
    space.add_arc((-10, 0), 5, 90, 270)
    block = document.blocks.new("hole")
    block.add_lwpolyline([(-1, -1), (1, -1), (1, 1), (-1, 1)], close=True)
    space.add_blockref("hole", (6, 0))
    space.add_line((0, 0), (1, 1))  # encloses nothing
    document.saveas(tmp_path / "slot.dxf")
    feature = build(tmp_path / "slot.dxf")
    found = at(feature, (2.5 + 0, 0), (2.5 + 6, 0), (2.5 - 15, 0), (2.5 - 13, 0), (2.5 + 8.5, 0))
    assert found == pytest.approx([1, 0, 0.5, 1, 1], abs=0.03)


def test_an_edge_that_no_net_holds_is_made_wider_and_a_thin_stroke_is_told(tmp_path):
    wide = svg(
        tmp_path / "wide.svg", '<rect width="400" height="10"/>', 'width="400mm" height="10mm" viewBox="0 0 400 10"'
    )
    assert any("flanks" in note for note in build(wide, "height:0.1mm,edge:0.01mm").notes)
    thin = svg(tmp_path / "thin.svg", '<rect x="0" y="0" width="20" height="0.5"/>')
    assert any("too narrow" in note for note in build(thin).notes)


BOMB = (
    "".join(f'<g id="g{i}">{f"""<use href="#g{i + 1}"/>""" * 10}</g>' for i in range(12))
    + '<g id="g12"><circle r="1"/></g>'
)
BAD = {
    "empty.svg": ("<svg xmlns='http://www.w3.org/2000/svg'/>", "no closed outline"),
    "text.svg": ("no outline", "not an SVG file"),
    "blank.svg": ("", "not an SVG file"),
    "line.svg": ("<svg xmlns='http://www.w3.org/2000/svg'><path d='M0 0 L10 0'/></svg>", "no closed outline"),
    "bad.svg": ("<svg xmlns='http://www.w3.org/2000/svg'><path d='M0 0 Lx y Z'/></svg>", "no closed outline"),
    "bomb.svg": (f"<svg xmlns='http://www.w3.org/2000/svg'>{BOMB}</svg>", "elements"),
    "loop.svg": ("<svg xmlns='http://www.w3.org/2000/svg'><g id='a'><use href='#a'/></g></svg>", "elements"),
    "laughs.svg": (
        "<!DOCTYPE s [<!ENTITY a 'aaaaaaaaaa'>"
        + "".join(f"<!ENTITY {b} '{f'&{a};' * 10}'>" for a, b in zip("abcdefghi", "bcdefghij", strict=True))
        + "]><svg xmlns='http://www.w3.org/2000/svg'><text>&j;</text></svg>",
        "not an SVG file",
    ),
    "text.dxf": ("no outline", "not a DXF file"),
    "blank.dxf": ("", "not a DXF file"),
}


@pytest.mark.parametrize("name", [*BAD, "missing.svg", "missing.dxf", "open.dxf"])
def test_files_without_an_outline_are_refused_in_one_line(tmp_path, name):
    content, said = BAD.get(name, (None, "cannot read" if "missing" in name else "no closed outline"))
    if content is not None:
        (tmp_path / name).write_text(content)
    elif name == "open.dxf":
        document = ezdxf.new()
        document.modelspace().add_line((0, 0), (5, 5))
        document.saveas(tmp_path / name)
    with pytest.raises(FileError) as error:
        build(tmp_path / name)
    assert "a SVG" not in str(error.value)
    assert said in str(error.value) and "\n" not in str(error.value) and error.value.code == Code.FILE
