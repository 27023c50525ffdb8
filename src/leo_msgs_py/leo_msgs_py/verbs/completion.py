# SPDX-License-Identifier: Apache-2.0
"""`leo completion`: a script with which bash or zsh completes verbs, options, robots and files."""

from collections.abc import Callable
from contextlib import redirect_stdout, suppress
from importlib.metadata import entry_points
import io
import re

from leo_msgs_py.verbs.common import Parser

EXAMPLES = """\
  leo completion bash > ~/.local/share/bash-completion/completions/leo
  leo completion zsh >> ~/.zshrc
  source <(leo completion bash)      # for this shell alone
"""
SCRIPT = """\
# Made by leo completion: verbs, options and robots as installed then.
_leo() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} words='{verbs}'
  if [ "$COMP_CWORD" -gt 1 ]; then
    case ${{COMP_WORDS[1]}} in
{cases}
    esac
  fi
  if [ "${{COMP_WORDS[COMP_CWORD-1]}}" = --model ]; then words='{robots}'; fi
  COMPREPLY=($(compgen -W "$words" -- "$word"))
}}
complete -o bashdefault -o default -F _leo leo
"""
ZSH = 'autoload -U +X compinit && compinit\nautoload -U +X bashcompinit && bashcompinit\n'
_OPTION = re.compile(r'(?<![\w-])--[a-z][a-z-]*')
_SUB_VERBS = re.compile(r'^ +([a-z0-9_-]+(?:\|[a-z0-9_-]+)+)$', re.MULTILINE)


def main(argv: list[str]) -> int:
    about = 'Print a script with which a shell completes leo.'
    parser = Parser('leo completion', about, EXAMPLES, json=False)
    parser.add_argument('shell', choices=('bash', 'zsh'))
    options = parser.parse_args(argv)
    words = {
        entry.name: _words(entry.load())
        for entry in entry_points(group='leo.verbs')
        if entry.name != 'completion'
    } | {'completion': ['bash', 'zsh']}
    cases = '\n'.join(f"      {v}) words='{' '.join(words[v])}' ;;" for v in sorted(words))
    robots = ' '.join(sorted({entry.name for entry in entry_points(group='leo.robots')}))
    script = SCRIPT.format(verbs=' '.join(sorted(words)), cases=cases, robots=robots)
    print((ZSH if options.shell == 'zsh' else '') + script, end='')
    return 0


def _words(verb: Callable[[list[str]], int], before: tuple[str, ...] = ()) -> list[str]:
    text = io.StringIO()
    with redirect_stdout(text), suppress(SystemExit):
        verb([*before, '--help'])
    usage = text.getvalue().partition('examples:')[0]
    found = _SUB_VERBS.search(usage)
    subs = found[1].split('|') if found and not before else []
    inside = [word for sub in subs for word in _words(verb, (sub,))]
    return list(dict.fromkeys([*subs, *_OPTION.findall(usage), *inside]))
