"""Print a script that completes commands, options, their values and files in a shell.

\b
bash         mracad completion bash > ~/.local/share/bash-completion/completions/mracad
zsh          mracad completion zsh > ~/.zfunc/_mracad, where ~/.zfunc is in fpath
fish         mracad completion fish > ~/.config/fish/completions/mracad.fish
PowerShell   mracad completion powershell >> $PROFILE
"""

from __future__ import annotations

import click
from click.shell_completion import get_completion_class

from mracad_cli.command import Plain
from mracad_cli.say import printing

SHELLS = "bash", "zsh", "fish", "powershell"

PROGRAM, VARIABLE = "mracad", "_MRACAD_COMPLETE"

FOLDERS = {
    "bash": ("            COMPREPLY+=($value)\n", "            [[ $value == */ ]] && compopt -o nospace\n"),
    "zsh": (
        '            if [[ "$descr" == "_" ]]; then\n',
        '            if [[ "$key" == */ ]]; then\n'
        "                compadd -U -S '' -V unsorted -- \"$key\"\n"
        '            elif [[ "$descr" == "_" ]]; then\n',
    ),
}
"""By shell, a line of click's script, and what makes it add no blank after a folder: for bash, a line that follows."""


@click.command(cls=Plain, help=__doc__, examples="mracad completion bash > mracad.bash")
@click.argument("shell", type=click.Choice(SHELLS))
def command(shell: str) -> None:
    kind = get_completion_class(shell)
    assert kind is not None
    script = kind.source_template % kind(click.Command(PROGRAM), {}, PROGRAM, VARIABLE).source_vars()
    with printing():
        click.echo(_with_folders(shell, script), nl=False)


def _with_folders(shell: str, script: str) -> str:
    """A script that adds no blank after a folder, so that the path can go on."""
    if shell == "bash":
        line, more = FOLDERS[shell]
        return script.replace(line, line + more)
    if shell == "zsh":
        return script.replace(*FOLDERS[shell])
    return script
