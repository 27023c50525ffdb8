# SPDX-License-Identifier: Apache-2.0
"""Play, pause, speed, scrub."""

from leo_diffmodel.watch.film import Player


def test_time_goes_on_while_it_plays_and_begins_again():
    clock = [100.0]
    player = Player(10.0, lambda: clock[0])
    player.go(4.0)
    clock[0] += 3
    assert player.now == 4.0 and not player.playing
    player.play()
    clock[0] += 3
    assert player.now == 7.0
    player.at_speed(0.5)
    clock[0] += 2
    assert player.now == 8.0
    player.play(False)
    clock[0] += 5
    assert player.now == 8.0
    player.play()
    clock[0] += 6
    assert player.now == 1.0


def test_one_cannot_go_beyond_the_ends():
    player = Player(10.0)
    player.go(12.0)
    assert player.now == 10.0
    player.go(-1.0)
    assert player.now == 0.0
