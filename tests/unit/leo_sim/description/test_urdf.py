# SPDX-License-Identifier: Apache-2.0
"""The joints of a URDF in their order, however many there are."""

from leo_sim.description.urdf import Joint, parse


def urdf(ends: list[tuple[str, str]]) -> str:
    links = ''.join(f'<link name="{name}"/>' for name in {n for pair in ends for n in pair})
    joints = ''.join(
        f'<joint name="to_{child}" type="fixed"><parent link="{parent}"/>'
        f'<child link="{child}"/></joint>'
        for parent, child in ends
    )
    return f'<robot name="tree">{links}{joints}</robot>'


def test_parents_come_first_and_else_the_order_of_the_file():
    ends = [('b', 'c'), ('a', 'd'), ('root', 'a'), ('d', 'e'), ('root', 'b'), ('a', 'f')]
    _, joints = parse(urdf(ends), 'tree.urdf')
    assert [joint.child for joint in joints] == ['a', 'd', 'e', 'b', 'c', 'f']


def test_joints_of_a_long_chain_are_not_compared_with_each_other(monkeypatch):
    compared = []
    monkeypatch.setattr(Joint, '__eq__', lambda a, b: compared.append(a) or a is b)
    chain = [(f'l{i}', f'l{i + 1}') for i in range(100)]
    _, joints = parse(urdf(chain[::-1]), 'chain.urdf')
    assert [joint.parent for joint in joints] == [parent for parent, _ in chain]
    assert not compared
