# SPDX-License-Identifier: Apache-2.0
"""Whether 'find it for me' on the page says what `leo explain` says, word for word.

    python benchmarks/watch_finds.py --first-seed 95001 --cases 10

Each blind case (one hidden effect, two in every third) is recorded, `leo watch` serves its bag,
the button is pressed over its own connection, and what the page then says is compared with
verdict and sentence of `leo explain --json`, run on the bag by itself. Exit status 1 where they
differ.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from html import unescape
import json
from pathlib import Path
import re
import subprocess
import sys
import tempfile
import time

from bokeh.client import pull_session
from bokeh.document import Document
from bokeh.document.events import MessageSentEvent
from bokeh.events import ButtonClick

from leo_lab.blind.case import draw_case
from leo_lab.blind.record import record
from leo_learner.processes import LEO

TAGS = re.compile(r'<[^>]+>')
PATIENCE, AGAIN = 3600.0, 4.0
"""The page is looked at again after so many times as long as a look takes, and some seconds."""


def leo(*words: str) -> list[str]:
    """A command of ours."""
    return [sys.executable, '-c', LEO, *words]


@contextmanager
def page(words: list[str]) -> Iterator[str]:
    """The address of the page that `leo watch` serves."""
    served = subprocess.Popen(
        leo('watch', *words, '--no-browser', '--json'),
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    assert served.stdout is not None
    try:
        yield json.loads(served.stdout.readline())['url']
    finally:
        served.terminate()
        served.wait()


def found_by_page(words: list[str]) -> str:
    """Verdict and sentence that the page shows after its button was pressed."""
    with page(words) as url:
        session = pull_session(url=url)
        press(session.document, 'find')
        session.force_roundtrip()
        session.close()
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            began = time.monotonic()
            if text := answer(url):
                return text
            time.sleep(AGAIN * (1.0 + time.monotonic() - began))
        raise SystemExit(f'no answer on the page in {PATIENCE:g} s')


def press(document: Document, name: str) -> None:
    """Press a button, as a browser tells the server that one was."""
    event = ButtonClick(document.get_model_by_name(name))
    document.callbacks.trigger_on_change(MessageSentEvent(document, 'bokeh_event', event))


def answer(url: str) -> str:
    """What a tab that is opened now shows of the answer; '' where there is none yet."""
    session = pull_session(url=url)
    said, button = (session.document.get_model_by_name(name) for name in ('said', 'find'))
    session.close()
    first = said.text.partition('</div>')[0]
    return '' if button.disabled else unescape(TAGS.sub('', first))


def explained(words: list[str]) -> str:
    """Verdict and sentence of the command."""
    done = subprocess.run(leo('explain', *words, '--json'), stdout=subprocess.PIPE, text=True)
    answer = json.loads(done.stdout)
    return f'{answer["verdict"]}: {answer["sentence"]}'


def same(seed: int) -> bool:
    """Compare both on a case, and print."""
    case = draw_case(seed, 'pair' if seed % 3 == 0 else 'effect')
    with tempfile.TemporaryDirectory() as folder:
        words = [*map(str, record(case, Path(folder))), '--model', case.robot.name]
        shown, told = found_by_page(words), explained(words)
    hidden = '+'.join(p.effect.name for p in case.effects)
    print(f'{seed} {case.robot.name} {hidden}: {"same" if shown == told else "DIFFERENT"}')
    print(
        *([f'  {told}'] if shown == told else [f'  page: {shown}', f'  leo explain: {told}']),
        sep='\n',
        flush=True,
    )
    return shown == told


def main() -> int:
    """Compare all and count."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').split('\n')[0])
    parser.add_argument('--first-seed', type=int, default=95001)
    parser.add_argument('--cases', type=int, default=10)
    given = parser.parse_args()
    seeds = range(given.first_seed, given.first_seed + given.cases)
    alike = sum([same(seed) for seed in seeds])
    print(f'word for word the same: {alike} of {len(seeds)}')
    return int(alike < len(seeds))


if __name__ == '__main__':
    sys.exit(main())
