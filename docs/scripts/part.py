import cadquery as cq

import mracad.cadquery

pad = cq.importers.importStep("assembly.step").solids(">Y").faces("%BSPLINE").smooth(scale=5)

plate = cq.Workplane().box(90, 60, 4)
jig = cq.Assembly(name="jig").add(plate, name="plate", color=cq.Color("orange")).add(pad, name="pad")
soft = mracad.smooth(jig, scale="8mm", max_deviation=0.1)
assert soft.objects["plate"].obj.val().isSame(plate.val())  # what no edit touches stays the same shape
soft.export("jig.step")
