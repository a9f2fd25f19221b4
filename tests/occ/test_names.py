"""Names, identifiers and layers in any character set come in as they were meant, and go out as the standard asks."""

import io
import re

import pytest
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
from OCP.gp import gp_Trsf, gp_Vec
from OCP.TCollection import TCollection_ExtendedString
from OCP.TopAbs import TopAbs_FACE
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.XCAFDoc import XCAFDoc_DocumentTool, XCAFDoc_ShapeTool

from mracad.errors import UsageError
from mracad.occ.charset import detect
from mracad.occ.contents import contents
from mracad.occ.document import named_labels
from mracad.occ.files import read, write
from mracad.occ.labels import components, label_name, labels, name_label
from mracad.occ.literals import decoded, encoded
from mracad.occ.load import Text
from mracad.occ.topology import compound
from tests.occ import shapes

WORDS = ("ASMWORD", "PARTWORD", "PARTNUMBER", "LEFTWORD", "FACEWORD", "LAYERWORD")
TEXTS = {
    "gb18030": ("机身总成", "蒙皮", "零件甲", "左蒙皮", "曲面", "红色层"),
    "cp932": ("組立品", "カバー", "部品", "左カバー", "上面", "レイヤ表"),
    "latin-1": ("Gehäuse", "Träger", "Größe", "Schlüssel", "Fläche", "höhere Ebene"),
    "cp1252": ("Œuvre", "Pièce", "Tête à vis", "Côté gauche", "Face évidée", "Calque „x“"),
    "utf-8": ("Ωmega 机", "Část", "😀", "левый", "ø12", "ß"),
}


def words_step():
    """An assembly of one box twice with a name wherever a file may have one, as the words in ``WORDS``."""
    move = gp_Trsf()
    move.SetTranslation(gp_Vec(5, 0, 0))
    box = BRepPrimAPI_MakeBox(1, 2, 3).Shape()
    document = shapes.assembly(box, TopLoc_Location(), TopLoc_Location(move))
    assembly, part = labels(document.shape_tool.GetShapes)
    face = document.shape_tool.AddSubShape(part, TopExp_Explorer(box, TopAbs_FACE).Current())
    for label, word in ((assembly, "ASMWORD"), (part, "PARTWORD"), (face, "FACEWORD")):
        name_label(label, word)
    for label, word in zip(components(assembly), ("LEFTWORD", "right"), strict=True):
        name_label(label, word)
    layers = XCAFDoc_DocumentTool.LayerTool_s(document.xcaf.Main())
    layers.SetLayer(face, TCollection_ExtendedString("LAYERWORD"), False)
    text = written(document)
    return text.replace(b"PRODUCT('PARTWORD'", b"PRODUCT('PARTNUMBER'")


def written(document):
    stream = io.BytesIO()
    write(document, stream)
    return stream.getvalue()


def put(text, names, encoding):
    for word, name in zip(WORDS, names, strict=True):
        assert word.encode() in text
        text = text.replace(word.encode(), name.encode(encoding))
    return text


def said(document):
    """What a document says, in the order of ``WORDS``."""
    found = contents(document)
    assembly, part = found.products
    title = next(title for title in document.titles.values() if title.name == part)
    (face,) = document.parts[0].face_names.values()
    return assembly, part, title.identifier, found.tree[1].path[-1], face, found.layers[0][1]


@pytest.mark.parametrize("encoding", TEXTS)
def test_texts_in_any_character_set(encoding):
    raw = put(words_step(), TEXTS[encoding], encoding)
    document = read(Text(raw, "names.step"))
    assert said(document) == TEXTS[encoding]
    assert bool(document.warnings) == (encoding != "utf-8")  # a guess is said to be one
    text = written(document)
    assert text.isascii()
    again = read(Text(text, "again.step"))
    assert said(again) == TEXTS[encoding] and not again.warnings
    assert written(again).split(b"DATA;")[1] == text.split(b"DATA;")[1]


def test_the_character_set_can_be_said():
    raw = put(words_step(), TEXTS["latin-1"], "latin-1")
    assert said(read(Text(raw, "x.step"), encoding="cp1251"))[0] == "Gehäuse".encode("latin-1").decode("cp1251")
    lossy = read(Text(raw, "x.step"), encoding="utf-8")
    assert said(lossy)[0] == "Geh\ufffduse" and "lost" in lossy.warnings[0]
    for wrong in ("bogus", "utf-16", "hex"):
        with pytest.raises(UsageError, match=wrong):
            read(Text(raw, "x.step"), encoding=wrong)


def test_directives_of_the_standard():
    texts = {
        r"a\X\E4\X4\0001F600\X0\ \S\d": "aä😀 ä",
        r"\X2\673A8EAB\X0\\X2\603B\X0\z": "机身总z",
        r"\PE\\S\X": "и",
        r"it''s C:\\x": "it's C:\\x",
        "Ж\\X2\\673A\\X0\\": "Ж机",
    }
    for raw, text in texts.items():
        assert decoded(raw.encode()) == text and decoded(encoded(text)) == text
        document = read(Text(words_step().replace(b"FACEWORD", raw.encode()), "x.step"))
        assert list(document.parts[0].face_names.values()) == [text]
        title = next(iter(read(Text(words_step().replace(b"PARTNUMBER", raw.encode()), "x.step")).titles.values()))
        assert title.identifier == text or title.name == "ASMWORD"


def test_a_name_broken_over_lines_stays_whole():
    name = "机" * 100
    document = read(Text(words_step().replace(b"FACEWORD", name.encode()), "x.step"))
    text = written(document)
    assert list(read(Text(text, "x.step")).parts[0].face_names.values()) == [name]
    assert text.isascii()


def test_empty_names_stay_empty_and_identifiers_stay():
    text = words_step().replace(b"'PARTNUMBER','PARTWORD',''", b"'','','what it is'")
    text = re.sub(rb"(USAGE_OCCURRENCE\()'1'", rb"\1'NAUO7'", text)
    document = read(Text(text, "x.step"))
    assert contents(document).products == ("ASMWORD", "")
    again = written(document)
    assert b"PRODUCT('','','what it is'" in again and b"USAGE_OCCURRENCE('NAUO7','LEFTWORD'" in again
    named = written(read(Text(text.replace(b"'','','what", b"'P-1','','what"), "x.step")))
    assert b"PRODUCT('P-1','','what it is'" in named
    assert contents(read(Text(named, "x.step"))).products == ("ASMWORD", "P-1")


def test_other_libraries_do_not_change_the_names_of_products(tmp_path):
    solids = [BRepPrimAPI_MakeBox(1, 2, 3).Shape(), BRepPrimAPI_MakeBox(3, 2, 1).Shape()]
    write(shapes.document(compound(solids)), tmp_path / "x.brep")
    XCAFDoc_ShapeTool.SetAutoNaming_s(False)  # as CadQuery leaves it
    try:
        assert contents(read(tmp_path / "x.brep")).products == ("x", "SOLID", "SOLID")
        assert not XCAFDoc_ShapeTool.AutoNaming_s()
    finally:
        XCAFDoc_ShapeTool.SetAutoNaming_s(True)


def test_names_of_an_iges_file():
    document = shapes.document(BRepPrimAPI_MakeBox(1, 2, 3).Shape(), names={0: "ABCDEFG"})
    stream = io.BytesIO()
    assert write(document, stream, "iges").lost == ()
    raw = stream.getvalue().replace(b"7HABCDEFG", b"7HGeh\xe4use")
    again = read(Text(raw, "x.igs"))
    assert "Gehäuse" in set(map(label_name, named_labels(again))) and again.warnings
    (lost,) = write(again, io.BytesIO(), "iges").lost
    assert lost.what == "names" and "Gehäuse" in str(lost)


def test_whole_files_are_told_by_their_words():
    """Some words of each kind, far fewer than a file has."""
    for words, encoding in (
        ("左蒙皮 右蒙皮2", "gb18030"), ("轴承座 电池盖", "gb18030"),
        ("기판 커버 볼트", "cp949"), ("機殼 上蓋 螺絲", "cp950"),
        ("上カバー", "cp932"), ("軸受 基板", "cp932"), ("ねじ 組立品", "euc_jp"),
        ("Größe", "cp1252"), ("Tête à vis", "cp1252"),
        ("Корпус Болт М6", "cp1251"), ("Těleso Śruba Šroub", "cp1250"),
    ):  # fmt: skip
        raw = words.encode(encoding)
        assert raw.decode(detect([raw])) == words
