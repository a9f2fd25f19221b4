# Try an installed mracad: sh -e try.sh SAMPLES, in a folder to write into.
mracad env
mracad smooth "$1/panel_clean.step" --scale 25mm --overwrite -o tried.step -o tried.png
mracad report tried.step --overwrite -o tried.html
mracad man man1
mracad completion bash > mracad.bash
test -s tried.step -a -s tried.png -a -s tried.html -a -s man1/mracad-smooth.1 -a -s mracad.bash
python -c 'import mracad; print(mracad.snapshot(mracad.read("tried.step")).name)'
