mracad feature make texture:hammered,width:20mm,height:0.3mm,pitch:5mm -o hammered.feature
mracad repeat panel_clean.step --feature hammered.feature --at 150,100,40 -o hammered.step
mracad repeat panel_clean.step --faces '#1' --feature "formula:'-0.5*exp(-(x*x+y*y)/4)',radius:5mm" \
    --fill hexagons,spacing:20mm \
    -o dimples.step -o dimples.png --picture-size 600x400
