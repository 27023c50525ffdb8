# SPDX-License-Identifier: Apache-2.0
"""`leo status`: how the robot, the recorder and the learner are doing."""

from typing import Any

from leo_msgs_py.interfaces import to_plain
from leo_msgs_py.verbs import common

_EXAMPLES = '  leo status\n  leo status --seconds 10 --json\n'
_LEVELS = ('ok', 'warning', 'error', 'stale')
_SECONDS = 2.5


def main(argv: list[str]) -> int:
    """Print what the nodes last said of themselves; 1 where nobody speaks or one has an error."""
    parser = common.Parser('leo status', 'How the nodes of the graph are doing.', _EXAMPLES)
    parser.add('--seconds', 'how long to listen', default=_SECONDS)
    options = parser.parse_args(argv)
    found = _listen(options.seconds)
    if not found and not options.json:
        print(f'no node says how it is {common.where()}')
        return 1
    common.show(options, found, [line for status in found for line in _lines(status)])
    return int(not found or any(s['level'] == 'error' for s in found))


def _listen(seconds: float) -> list[dict[str, Any]]:
    """The last status of each part that reports on /diagnostics, by name."""
    from leo_msgs_py import topics
    from leo_msgs_py.node import listen, spin_until

    latest: dict[str, Any] = {}

    def keep(message: Any) -> None:
        latest.update({status.name: status for status in message.status})

    with common.probe(settled=False) as node:
        listen(node, topics.DIAGNOSTICS, keep)
        spin_until(lambda: False, seconds)
    return [_plain(latest[name]) for name in sorted(latest)]


def _plain(status: Any) -> dict[str, Any]:
    return {
        'name': status.name,
        'level': _LEVELS[int(to_plain(status.level))],
        'message': status.message,
        'values': {pair.key: pair.value for pair in status.values},
    }


def _lines(status: dict[str, Any]) -> list[str]:
    head = f'{status["name"]}: {status["level"]}, {status["message"]}'
    return [head, *(f'  {key}: {value}' for key, value in status['values'].items())]
