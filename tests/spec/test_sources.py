"""Sources of features as texts."""

import pytest

from mracad.errors import UsageError
from mracad.spec.places import feature
from mracad.spec.sources import Formula, Heightmap, Outline, Texture, is_source, path_of, source
from mracad.spec.steps import Move, Repeat


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("a/logo.png,width:30mm,height:0.4mm", Heightmap("a/logo.png", 30.0, 0.4)),
        ("a,b.tif , width: 1in, height:0.5, spacing:0.1mm", Heightmap("a,b.tif", 25.4, 0.5, 0.1)),
        ("h.npy,width:3cm", Heightmap("h.npy", 30.0)),
        ("x.SVG,height:0.4mm,edge:0.3mm", Outline("x.SVG", 0.4, 0.3)),
        ("x.dxf,height:1,width:50mm", Outline("x.dxf", 1.0, None, 50.0)),
        ("texture:leather,width:40mm,height:0.2mm,pitch:2mm,seed:7", Texture("leather", 40.0, 0.2, 2.0, 7)),
        ("formula:'atan2(y,x)*max(x,0)',radius:10mm", Formula("atan2(y,x)*max(x,0)", 10.0)),
    ],
)
def test_texts_mean_sources(text, meant):
    assert source(text, "feature") == feature(text, "feature") == meant


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("logo.png,height:1", "the width of the heightmap is missing"),
        ("logo.png,width:3", "the height of 'logo.png' is missing"),
        ("logo.svg,width:3", "the height of the outline is missing"),
        ("logo.png,width:-3,height:1", "'-3' is not greater than zero"),
        ("logo.png,width:5%,height:1", "'5%' is not a length"),
        ("logo.png,width:30mm,height:1mm,edge:1", "takes no 'edge'"),
        ("logo.svg,height:1mm,colour:1", "an outline takes no 'colour'"),
        ("logo.png,width:x,height:1", "feature: width: 'x' is not a length; write width:5mm or width:0.2in"),
        ("logo.png,width:9,height:-0.4mm", "or height:0.2in, and turn copies inwards with --height -1"),
        ("texture:snow,width:3,height:1", "no texture 'snow'"),
        ("texture:knurl,width:3,height:1,seed:x", "seed 'x'"),
        ("formula:x", "the radius of the formula is missing"),
    ],
)
def test_bad_texts_are_refused_in_one_line(text, said):
    with pytest.raises(UsageError) as error:
        source(text, "feature")
    assert said in str(error.value) and "\n" not in str(error.value)


def test_a_source_names_its_file_and_keeps_its_sizes_when_that_moves():
    options = Repeat(feature="logo.png,width:30mm,height:0.4mm", at=("0,0,0",))
    assert options.files() == ("logo.png",)
    assert options.relocated({"logo.png": "/b/logo.png"}).feature == "/b/logo.png,width:30mm,height:0.4mm"
    assert Repeat(feature="texture:knurl,width:9,height:1", at=("0,0,0",)).files() == ()
    assert (
        path_of("formula:x,radius:3") is None and not is_source("#3@0:1,0:1") and not is_source("near:1,2,3,radius:4")
    )


def test_what_no_model_contains_cannot_be_moved():
    with pytest.raises(UsageError, match="cannot be moved"):
        Move(feature="logo.png,width:30mm,height:0.4mm", to="0,0,0")
