mracad spectrum assembly.step -o spectrum.csv
mracad denoise assembly.step -o clean.step
mracad compare assembly.step clean.step --max-deviation 0.2mm
