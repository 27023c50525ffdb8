# SPDX-License-Identifier: Apache-2.0
"""How long a command looks for the graph before it says what is there."""

from types import SimpleNamespace

import pytest

from leo_msgs_py.verbs import common

LOOK = 0.05


@pytest.mark.parametrize(('seen_after', 'looked'), [(0.0, 0.5), (1.0, 1.3), (60.0, 3.0)])
def test_somebody_is_waited_for_and_an_empty_graph_is_left(monkeypatch, seen_after, looked):
    now = [0.0]

    def names() -> list[tuple[str, str]]:
        return [('_leo_1', '/'), *[('robot', '/')] * (now[0] >= seen_after)]

    def spin_once(seconds: float) -> None:
        now[0] += seconds

    node = SimpleNamespace(
        get_name=lambda: '_leo_1',
        get_node_names_and_namespaces=names,
        get_topic_names_and_types=list,
        get_service_names_and_types=list,
    )
    monkeypatch.setattr(common.time, 'monotonic', lambda: now[0])
    monkeypatch.setattr('leo_msgs_py.node.running', lambda: True)
    monkeypatch.setattr('leo_msgs_py.node.spin_once', spin_once)
    common.settle(node)
    assert now[0] == pytest.approx(looked, abs=2 * LOOK)
