"""Files in and out of a command: checked before the work starts, written whole or not at all."""

from __future__ import annotations

import os
import sys
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

from mracad import note
from mracad.errors import FileError, UsageError, needing
from mracad.formats import FORMATS, Format, by_extension
from mracad.spec.fields import dashed
from mracad.spec.pictures import Scalars
from mracad.store import Location, Url, is_url, location, missing
from mracad_cli.options import PAGES, PICTURES, Reading, Reports, Writing, model
from mracad_cli.params import Declared
from mracad_cli.say import json_text, printing, say, warn

MESHES = {**dict.fromkeys(("chord", "angle"), ("mesh", "stl")), "ascii_stl": ("stl", "stl")}
OF = {**dict.fromkeys(PICTURES.values(), ("picture", "png")), **MESHES, "schema": ("step", "step")}
"""The kind or name of the formats that options are for, and a format of that kind."""

if TYPE_CHECKING:
    from mracad.job.judge import Judged
    from mracad.job.output import Made, Target
    from mracad.occ.document import Document
    from mracad.occ.load import Text


def load(source: str) -> Text:
    """The bytes of a file, or of standard input for ``-``."""
    from mracad.occ.load import load as load_file

    return load_file(sys.stdin.buffer if source == "-" else source)


def read(reading: Reading, text: Text | None = None) -> Document:
    """Read a model, from ``text`` if it is loaded already; print warnings."""
    text = text or load(reading.file)
    note.doing("reading", text.name)
    document = read_silently(reading, text)
    for warning in document.warnings:
        warn(warning)
    return document


def read_silently(reading: Reading, text: Text) -> Document:
    """Read a model, maybe once more."""
    from mracad.occ.files import read as read_file

    return read_file(text, reading.input_unit, reading.encoding)


def check_outputs(writing: Writing, beside: Collection[str | None] = (), *, dry: bool = False) -> list[Target]:
    """The outputs to write; refuses outputs, and files ``beside`` them, that could not be written.

    Raises
    ------
    UsageError
        When none is named, or an output exists, except for a ``dry`` run; when a file is named twice, one beside them
        exists, or options are given for formats in which nothing is written.
    FileError
        For an unknown file extension, or a folder that cannot be written to.
    """
    from mracad.job.output import Target

    paths = writing.outputs
    if not (dry or paths):
        raise UsageError("no output is named", "name a file with -o OUT.step, or - for standard output")
    if paths.count("-") > 1:
        raise UsageError("- is named twice", "give each -o once")
    formats = {path: FORMATS[writing.format] if path == "-" else by_extension(path) for path in paths}
    if any(format.name == "mp4" for format in formats.values()):
        with needing("video", "cannot write MP4"):
            import imageio_ffmpeg  # noqa: F401
    given = _check_options(formats.values(), OF, "add -o OUT.{}")
    if "format" in given and "-" not in paths:
        raise UsageError("format: nothing is written to standard output", "add -o -, or leave --format out")
    _check_scalars(formats.values(), writing.scalars, "add an output in {}")
    for format in formats.values():
        writing.picture.check(format.name)
    files = [path for path in paths if path != "-"]
    replaces = writing.overwrite or writing.if_changed
    check_reports(*files, *beside, overwrite=replaces or dry)
    check_reports(*beside, overwrite=replaces)
    mesh = writing.chord, writing.angle, writing.ascii_stl
    how = (writing.schema or "").upper(), *mesh, writing.picture, writing.scalars
    return [
        Target("standard output" if path == "-" else location(path).name, format.name, *how)
        for path, format in formats.items()
    ]


def check_meshes(formats: Collection[Format], scalars: Scalars) -> None:
    """Refuse options of meshes where a batch writes none."""
    _check_options(formats, MESHES, "add --format {}")
    _check_scalars(formats, scalars, "write {} with --format")


def _check_options(formats: Collection[Format], kinds: Mapping[str, tuple[str, str]], hint: str) -> list[str]:
    """Refuse options on the command line that would have no effect on outputs of these formats; returns all given."""
    context = click.get_current_context()
    given = [name for name in context.params if context.get_parameter_source(name) is ParameterSource.COMMANDLINE]
    written = {word for format in formats for word in (format.kind, format.name)}
    for name in given:
        kind, usual = kinds.get(name, ("", ""))
        if kind and kind not in written:
            what = kind if kind in ("picture", "mesh") else f"{kind.upper()} file"
            option = "ascii" if name == "ascii_stl" else dashed(name)
            raise UsageError(f"{option}: no {what} is written", f"{hint.format(usual)}, or leave --{option} out")
    return given


def _check_scalars(formats: Collection[Format], scalars: Scalars, hint: str) -> None:
    """Refuse numbers at points for meshes that cannot hold them."""
    if not scalars.scalar:
        return
    able = ", ".join(each.extensions[0] for each in FORMATS.values() if each.scalars)
    for format in formats:
        if format.kind == "mesh" and not format.scalars:
            raise UsageError(f"scalar: {format.name.upper()} holds no numbers at points", f"write {able}")
    if not any(format.scalars for format in formats):
        raise UsageError("scalar: no mesh is written", f"{hint.format(able)}, or leave --scalar out")


def _check_inputs(ctx: click.Context) -> None:
    """Refuse inputs on this machine that do not exist; those of a batch fail one by one."""
    for param in ctx.command.params:
        given = ctx.params.get(param.name or "")
        for text in (given if isinstance(given, tuple | list) else [given]) if given and param.nargs == 1 else ():
            naming = param.type.field.naming if isinstance(param.type, Declared) else None
            file = text if param.type is model else naming.file(text) if naming else None
            if file and file != "-" and isinstance(where := location(file), Path) and not where.exists():
                raise missing(where)


def check_reports(*paths: str | None, overwrite: bool) -> None:
    """Refuse reports that could not be written, and two that would be the same file."""
    given = [location(path) for path in paths if path]
    for number, path in enumerate(given):
        if path.resolve() in [other.resolve() for other in given[:number]]:
            raise UsageError(f"{path} is named twice", "give each file that is written a name of its own")
        check_target(path, overwrite)


def check_page(path: str | None) -> None:
    """Refuse a page that is not HTML, or cannot be made here."""
    if path is None:
        return
    if not path.lower().endswith(PAGES):
        raise UsageError(f"cannot write {path}: reports with pictures are HTML", "name a file that ends in .html")
    with needing("view", "cannot make a report"):
        import jinja2  # noqa: F401
        import matplotlib  # noqa: F401


def check_junit(path: str, overwrite: bool) -> None:
    """Refuse a report for CI that is not XML, or could not be written."""
    if not path.lower().endswith(".xml"):
        raise UsageError(f"cannot write {path}: JUnit is XML", "name a file that ends in .xml")
    check_target(location(path), overwrite)


def check_target(path: Location, overwrite: bool) -> None:
    """Refuse an output that could not be written, or that exists already."""
    if isinstance(path, Url):
        path.check()
    else:
        _check_folder(path)
    if not overwrite and path.exists():
        _check_inputs(click.get_current_context())
        raise UsageError(f"{path} exists", "give --overwrite to replace it")


def _check_folder(path: Path) -> None:
    """Refuse a path on this machine that could not be written."""
    if path.is_dir():
        raise FileError(f"cannot write {path}: it is a directory", "name a file in it")
    if not path.parent.is_dir():
        raise FileError(f"cannot write {path}: there is no folder {path.parent}", "create it first")
    if not os.access(path.parent, os.W_OK):
        raise FileError(f"cannot write {path}: the folder is not writable", "choose another one")


def check_depfile(depfile: str | None, *files: str | None) -> None:
    """Refuse rules for make with files that it cannot see."""
    far = next((file for file in files if file and is_url(file)), None)
    if depfile and far:
        raise UsageError(f"depfile: make cannot see {far}", "leave --depfile out")


def deliver(files: Mapping[str, str | bytes | None], lines: Iterable[str], *, stream: bytes | None = None) -> None:
    """End a command: print its lines and put its files in place; all of this or nothing.

    Parameters
    ----------
    files : mapping
        Contents by path; texts are written as UTF-8, None is skipped.
    lines : iterable of str
        The lines to print.
    stream : bytes, optional
        A model for standard output; the lines then go to standard error.

    Raises
    ------
    FileError
        When a file cannot be written.
    """
    from mracad.output import put_all

    said = list(lines)

    def tell() -> None:
        if stream is not None:
            with printing():
                sys.stdout.buffer.write(stream)
        say(*said, aside=stream is not None)

    contents = {path: content for path, content in files.items() if content is not None}
    put_all({p: c.encode(errors="surrogateescape") if isinstance(c, str) else c for p, c in contents.items()}, tell)


def deliver_models(
    writing: Writing, made: Sequence[Made], files: Mapping[str, str | bytes | None], lines: Iterable[str]
) -> None:
    """End a command that made models, one for each output or none; see :func:`deliver`."""
    from mracad.output import holds

    for each in made:
        if each.written.lost:
            warn(f"{each.target.name} lacks {', '.join(map(str, each.written.lost))}")
        if each.note:
            warn(each.note)
    data = {path: each.data for path, each in zip(writing.outputs, made, strict=False)}
    stream = data.pop("-", b"" if "-" in writing.outputs else None)
    changed = {p: d for p, d in data.items() if not (writing.if_changed and holds(location(p), d))}
    deliver({**changed, **files}, lines, stream=stream)


def deliver_verdict(judged: Judged, command: str, reports: Reports, document: Document, other: Document | None) -> int:
    """End a command that judges a document, maybe beside an ``other``; returns the exit code."""
    from mracad_cli.render import json, junit, sarif, text

    found = judged.verdict, judged.failed
    files: dict[str, str | bytes | None] = {reports.junit: junit.verdict(*found, command)} if reports.junit else {}
    files |= {reports.sarif: json_text(sarif.verdict(*found, command), 1) + "\n"} if reports.sarif else {}
    if reports.report_html:
        from mracad_cli.render import pages

        files[reports.report_html] = pages.judged(document, other, judged, command)
    wrote = [f"wrote {reports.report_html}"] if reports.report_html else []
    deliver(files, [json_text(json.verdict(*found))] if reports.as_json else [*text.verdict_lines(*found), *wrote])
    return 0 if judged.passed else 1


def depfile_text(outputs: Iterable[str], inputs: Iterable[str]) -> str:
    """A make rule with what the outputs depend on, and an empty rule per input, so that make accepts a missing one."""
    targets, needs = ([_for_make(path) for path in paths if path != "-"] for paths in (outputs, inputs))
    return f"{' '.join(targets)}: {' '.join(needs)}\n" + "".join(f"\n{need}:\n" for need in needs)


def _for_make(path: str) -> str:
    return path.replace("$", "$$").replace("#", "\\#").replace(" ", "\\ ")
