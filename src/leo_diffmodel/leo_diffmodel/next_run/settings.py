# SPDX-License-Identifier: Apache-2.0
"""Every number of next with its unit and reason; the figures of a run stand with its shape."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """How far a run may take a robot that has been through what its bags show."""

    # Inputs
    more_input: float = 1.25
    """Times the largest input of the bags [V, N m]; times the range of their goals."""
    least_level: float = 0.3  # of the limit [V, N m]: allowed though the bags show less
    least_goals: float = 0.1
    """Of half of a joint's range: likewise for goals, which lead past what nobody described."""

    # Motion
    margin: float = 0.05  # of a joint's range: how far its angle and its goals stay from each stop
    more_speed: float = 1.5  # times the largest speed of the bags
    slow: float = 0.5
    """rad/s: a servo takes a joint to where a run begins so fast (29 degrees a second), as one
    jogs an arm by hand."""
    slow_slide: float = 0.05  # m/s: likewise on a slide
    settle: float = 0.5
    """s at rest before the run proper: five times what a servo takes to come to rest."""

    # Milder runs
    taming: float = 0.6  # times its size is the next milder run,
    most_taming: int = 5  # so often: down to 8 %, which is hardly a run any more

    # Open answers
    sds: float = 2.0  # standard deviations to the ends of what a parameter may be: 95 %

    # What a run says
    least_useful: float = 1.0  # nats; less than that is nothing
    most_choices: int = 5  # answers to one question, which are all fitted
    fitted_on_ground: int = 80  # windows of a fit on the ground, seconds each
    most_windows: int = 40  # of each run, to tell answers apart;
    windows_on_ground: int = 20  # on the ground, where one takes longer
    rounds: int = 4  # of weighing windows that say too much anew
    tried_seconds: float = 6.0
    """A scripted motion is simulated so long [s], and its evidence grown to its length."""

    # a run before it is sent
    touch: float = 1e-3  # rad or m: a joint so near to its stop is at it
    clear: float = 0.02
    """rad or m: one so far from it has left it; one that lies there may be measured off it."""
    hits_shown: int = 4  # things it runs into that are named one by one
    near: float = 0.15  # rad or m: a joint so near to a start pose is in it, as drivers judge it


NEXT = Limits()
