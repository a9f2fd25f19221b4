"""Write manual pages of all commands into a folder: mracad.1, mracad-smooth.1 …"""

from __future__ import annotations

import click

from mracad.errors import FileError
from mracad.store import location
from mracad_cli import options
from mracad_cli.command import Plain, every, groups
from mracad_cli.outputs import deliver


@click.command(cls=Plain, help=__doc__, examples="mracad man man1")
@click.argument("folder", metavar="DIR", type=options.folder)
@click.pass_context
def command(ctx: click.Context, folder: str) -> None:
    from mracad_cli.render import man

    try:
        location(folder).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"cannot write into {folder}: {error.strerror}", "name another folder") from error
    root = ctx.find_root().command
    commands = every(root)
    pages = {"mracad": man.overview(root, commands)}
    for name, group in groups(root).items():
        own = {each: page for each, page in commands.items() if each.startswith(f"{name} ")}
        pages[f"mracad-{name}"] = man.overview(group, own, name)
    for name, page in commands.items():
        pages[f"mracad-{name.replace(' ', '-')}"] = man.page(name, page, ctx.find_root())
    deliver({str(location(folder) / f"{name}.1"): text for name, text in pages.items()}, [f"wrote {len(pages)} pages"])
