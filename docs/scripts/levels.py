import numpy as np

import mracad
from mracad.wavelet import wavedec, waverec

net = mracad.snapshot("panel.step").surfaces[0].net  # or a BSpline or NdBSpline of scipy
pyramid = wavedec(net)
print([level.heights["HH"].max() for level in pyramid.levels])  # mm, the finest level first
assert np.abs(waverec(pyramid).poles - net.poles).max() < 1e-12

fractional = waverec(pyramid, level=2.5)  # without two and a half levels, over the same knots
lean = waverec(pyramid.thresholded(0.05))  # without details up to 0.05 mm
