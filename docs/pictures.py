"""Draw the pictures of the documentation, and write the gallery with the commands that draw them.

Usage: python docs/pictures.py
"""

from __future__ import annotations

import shlex
import subprocess
import sys
from pathlib import Path

import mracad
from mracad.job.document import play
from mracad.spec import recipe

HERE = Path(__file__).parent
SAMPLES = HERE.parent / "samples"
SHELL = SAMPLES / "shell.step"
EXAMPLE = SAMPLES / "example" / "recipe.toml"
SMALL = "--size 900x600"

HEAD = """# Gallery

Made by `make pictures`, from these commands alone.
"""

GALLERY = (
    ("A document as it is", f"mracad render samples/assembly.step -o assembly.png {SMALL}"),
    (
        "Noise, seen in reflections: a panel as it comes, and as it should be",
        "mracad render samples/panel_clean.step -o noise.png --before samples/panel.step --wipe --show zebra "
        "--stripes 60 --view top --size 900x600",
    ),
    (
        "What smoothing moved",
        "mracad smooth samples/panel.step --scale 25mm -o moved.png --show deviation --view=-1,-2,2",
    ),
    (
        "Curvature of the surfaces themselves, not of triangles",
        f"mracad render samples/bottle.step -o curvature.png --show curvature:gauss {SMALL}",
    ),
    (
        "Sections with their curvature as combs: noise of 0.02 mm that no eye sees on the surface",
        "mracad render samples/panel.step -o comb.png --section x=150mm --section y=100mm --comb --view=-1,-2,2 "
        "--size 900x500",
    ),
    (
        "What an edit did: faces by outcome, edges that moved or stayed",
        "mracad smooth samples/shell.step --scale 8mm --hold '#6' --faces '!#1' -o treatment.png --show treatment "
        "--picture-size 900x500",
    ),
    (
        "The spectrum of a face: its heights by wavelength, the noise floor, where its shape begins",
        "mracad spectrum samples/panel.step --faces '#3' -o spectrum.png",
    ),
    (
        "Dimples over four patches, as if there were no seams",
        "mracad repeat samples/panel_clean.step --faces '#1' --faces '#2' --faces '#3' --faces '#4' "
        "--feature \"formula:'-0.5*exp(-(x*x+y*y)/4)',radius:5mm\" "
        "--fill hexagons,spacing:12mm --margin 3mm -o dimples.png --view=-1,-2,3",
    ),
    (
        "Leather on a panel",
        "mracad repeat samples/panel_clean.step --feature texture:leather,width:90mm,height:0.6mm,pitch:6mm "
        "--at 150,100,60 -o leather.png --view=-1,-2,3",
    ),
)


def draw(document: mracad.Document, name: str, **options: object) -> None:
    """One picture with zebra stripes."""
    picture = mracad.render(document, show="zebra", **options)  # type: ignore[arg-type]
    (HERE / name).write_bytes(picture.data)
    print(f"{name}: {len(picture.data) / 1e3:.0f} kB")


def panel() -> None:
    """The panel as it came, smoothed with its seams frozen, and with its seams moving."""
    options = {"view": ("top",), "size": "480x360", "stripes": 60}
    draw(mracad.read(SAMPLES / "panel.step"), "panel-0.png", **options)
    for number, edges in enumerate(("frozen", "coupled"), 1):
        document = mracad.smooth(SAMPLES / "panel.step", scale="25mm", edges=edges)
        draw(document, f"panel-{number}.png", **options)


def example() -> None:
    """The shell as it came, and after each edit of the example."""
    options = {"view": ("-0.3,-0.8,1.1",), "size": "640x420", "stripes": 30}
    document = mracad.read(SHELL)
    draw(document, "example-0.png", **options)
    *edits, _ = recipe.load(str(EXAMPLE)).steps(str(SHELL))
    for number, step in enumerate(edits, 1):
        play(document, [step])
        draw(document, f"example-{number}.png", **options)


def output(command: str) -> str:
    """The name of the picture that a command draws."""
    words = shlex.split(command)
    return words[words.index("-o") + 1]


def gallery() -> None:
    """The pictures of the gallery."""
    folder = HERE / "gallery"
    folder.mkdir(exist_ok=True)
    for _, command in GALLERY:
        name = output(command)
        words = [str(folder / name) if word == name else word for word in shlex.split(command)[1:]]
        subprocess.run([sys.executable, "-m", "mracad_cli", *words, "--overwrite"], cwd=HERE.parent, check=True)


def page() -> str:
    """The page of the gallery."""
    entries = (
        f"**{title}.**\n\n```sh\n{command}\n```\n\n![{title}](gallery/{output(command)})\n"
        for title, command in GALLERY
    )
    return "\n".join([HEAD, *entries])


if __name__ == "__main__":
    panel()
    example()
    gallery()
    (HERE / "gallery.md").write_text(page())
