"""Tell versions, the CAD kernel, threads, caches and the defaults that hold here, as for a report of a fault.

Nothing else is told: of paths only those of this folder's project and of the cache, no names of users or machines. Exit
code 1 if anything is wrong.
"""

from __future__ import annotations

import click

from mracad_cli import options
from mracad_cli.command import Plain, every
from mracad_cli.say import json_text, say


@click.command(cls=Plain, help=__doc__, examples="mracad env --json")
@options.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
@click.pass_context
def command(ctx: click.Context, as_json: bool) -> int:
    from mracad_cli.render import env

    body = env.body(every(ctx.find_root().command))
    say(*([json_text(body)] if as_json else env.lines(body)))
    return 1 if body["problems"] else 0
