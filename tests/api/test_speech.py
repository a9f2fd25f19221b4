"""Errors speak Python where they are raised in Python: no message names an option of the command line."""

import ast
import re
from pathlib import Path

import pytest

import mracad
from mracad.api.speech import explained, spoken
from mracad.spec.fields import fields
from mracad.spec.pictures import Picture
from mracad.spec.steps import STEPS

ROOT = Path(mracad.__file__).parent
ELSEWHERE = {
    "api",
    "report",
    "batch",
    "guard.py",
    "wire.py",
    "recipe.py",
    "text.py",
    "schema.py",
    "literals.py",
    "triangles.py",
}
"""Rooms and modules whose messages do not reach Python, or name options that are no keywords."""


def texts():
    """Every text in the library that names an option; what is filled in is the name or the value of one."""
    for path in ROOT.rglob("*.py"):
        if not ELSEWHERE.intersection(path.relative_to(ROOT).parts):
            for node in ast.walk(ast.parse(path.read_text())):
                said = ""
                for part in node.values if isinstance(node, ast.JoinedStr) else [node]:
                    text = part.value if isinstance(part, ast.Constant) and isinstance(part.value, str) else ""
                    said += text or ("scale" if said.endswith("--") else "7" if said else "")
                if re.search(r"--(?!help|all)[a-z]", said) and "\n" not in said and not said.startswith("mracad "):
                    yield said


@pytest.mark.parametrize("said", sorted({*texts()}))
def test_no_option_is_named_as_on_the_command_line(said):
    known = {name for struct in [*STEPS.values(), Picture] for name in fields(struct)} | {"details"}
    heard = spoken(said)
    assert "--" not in heard and "--" not in explained(said)
    named = re.findall(r"(?<![\w#:'-])([a-z]\w*)=('[^']*'|-?[.\d]*\d|True|False)?(?![\w])", heard)
    assert named and {name for name, _ in named} <= known
    for name, value in named:
        ast.parse(f"f({name}={value or 'None'})")


@pytest.mark.parametrize(
    "said, heard",
    [
        ("give --scale 5mm, --scale 2%, --level 2.5 or --max-deviation 0.2mm",
         "give scale='5mm', scale='2%', level=2.5 or max_deviation='0.2mm'"),
        ("limit-by-curvature: levels are not limited by it", "limit_by_curvature: levels are not limited by it"),
        ("give --from and --to, or --map '#3=#7,#4=#8'", "give from_= and to=, or map='#3=#7,#4=#8'"),
        ("add --free-edges smooth", "add free_edges='smooth'"),
        ("leave such places out with --skip-off", "leave such places out with skip_off=True"),
        ("fill: it finds all places itself, without --at", "fill: it finds all places itself, without at="),
        ("give --height 0.5, or a negative one", "give height=0.5, or a negative one"),
        ("see mracad smooth --help", "see help(mracad.smooth)"),
        ("copy it with mracad repeat; see mracad info --all", "copy it with mracad.repeat; see mracad.info"),
        ("make one with mracad feature make", "make one with mracad feature make"),
    ],
)  # fmt: skip
def test_messages_in_the_words_of_python(said, heard):
    assert spoken(said) == heard


def test_errors_are_raised_so(samples):
    with pytest.raises(mracad.UsageError, match="give scale='5mm'"):
        mracad.smooth(samples / "assembly.step")
    with pytest.raises(mracad.UsageError, match="'nonsense' is not a length; write scale as 5mm"):
        mracad.smooth(samples / "assembly.step", scale="nonsense")
    with pytest.raises(TypeError, match=r"smooth\(\) has no option 'scal'; did you mean 'scale'\?"):
        mracad.smooth(samples / "assembly.step", scal=5)
    with pytest.raises(TypeError, match=r"missing a required .*argument: 'feature'"):
        mracad.repeat(samples / "assembly.step")
