"""Examples of edits, for their docstrings; they run in the folder of the samples."""

EXAMPLES = {
    "smooth": """
>>> fair = mracad.smooth("assembly.step", scale="5mm")
>>> fair
Document(assembly.step: 1 NURBS face of 15, in, AP214, 1 edit)
>>> [round(each.largest, 2) for each in mracad.report_of(fair).deviations]  # mm
[0.06]
""",
    "denoise": """
>>> clean = mracad.denoise("assembly.step")
>>> [each.status for each in mracad.report_of(clean).edit.outcomes if each.face == 6]
['edited']
""",
    "offset": """
>>> grown = mracad.offset("assembly.step", distance=0.5, refine="never")
>>> len(mracad.report_of(grown).edit.faces("edited"))
1
""",
    "equalize": """
>>> weaker = mracad.equalize("assembly.step", band="2mm:10mm=0.5")
>>> len(mracad.report_of(weaker).edit.faces("edited"))
1
""",
    "sweep": """
>>> bent = mracad.sweep("assembly.step", at="#7@25,12", by=(0, 0, 1), scale=10)
>>> [round(each.moved) for each in mracad.report_of(bent).edit.faces("edited")]  # mm
[1]
""",
    "level": """
>>> coarse = mracad.level("assembly.step", level=2)
>>> before, after = mracad.report_of(coarse).control_points
>>> before, after
(493, 493)

""",
    "compose": """
>>> coarse = mracad.level("assembly.step", level=2, details="pad.mra")
>>> again = mracad.compose(coarse, details="pad.mra")
>>> mracad.compare(again, "assembly.step").passed
True
""",
    "move": """
>>> moved = mracad.move("assembly.step", feature="near:15,12,9,radius:3", to="#7@35,12")
>>> len(mracad.report_of(moved).edit.copies)
1
""",
    "repeat": """
>>> bumpy = mracad.repeat("assembly.step", feature="formula:0.2*cos(x),radius:3mm", at=[(15, 12, 9), (35, 12, 9)])
>>> len(mracad.report_of(bumpy).edit.copies)
2
""",
    "transfer": """
>>> rough = mracad.transfer("assembly.step", source="assembly.step", map="place", band=":3mm")
>>> [each.face for each in mracad.report_of(rough).edit.faces("edited")]
[6]
""",
}
