# SPDX-License-Identifier: Apache-2.0
"""Read a report as a browser would: what it loads, and the text that is seen; a page to show."""

from html.parser import HTMLParser
import re
from types import SimpleNamespace

from leo_sim.common.worker import News

LARGEST = 5_000_000


class Links(HTMLParser):
    """Collects what a browser would load or link to, and the visible text."""

    def __init__(self, html):
        super().__init__()
        self.urls, self.text, self.scripts, self._in = [], [], 0, ''
        self.feed(html)

    def handle_starttag(self, tag, attrs):
        self._in = tag
        self.scripts += tag == 'script'
        self.urls += [v for k, v in attrs if k in ('src', 'href', 'srcset', 'data', 'action')]
        assert tag != 'link'

    def handle_endtag(self, tag):
        self._in = ''

    def handle_data(self, data):
        if self._in == 'style':
            assert 'url(' not in data and '@import' not in data
        if self._in not in ('script', 'style'):
            self.text.append(data)


def read(html: str) -> tuple[Links, str]:
    assert len(html.encode()) < LARGEST
    links = Links(html)
    return links, re.sub(r'\s+', ' ', ''.join(links.text))


def no_run(**known: object) -> SimpleNamespace:
    """What to record next as the live page sees it, as long as nothing is but what is `known`."""
    unasked = {'busy': False, 'news': News(), 'plan': None, 'hindrance': '', 'said': ''}
    unwritten = {'file': None, 'words': [], 'recorded': [], 'start': lambda: None}
    return SimpleNamespace(**{**unasked, **unwritten, **known})
