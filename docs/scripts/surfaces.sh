mracad smooth panel.step --scale 25mm --max-deviation 0.1mm \
    -o fair.step -o fair.png --show zebra --picture-size 600x400
mracad check fair.step --expect 7 --max-gap 1um --max-angle 0.05deg
mracad compare panel.step fair.step --max-deviation 0.1mm
