# SPDX-License-Identifier: Apache-2.0
"""What decides an answer.

Set on seeds 1000 to 1035 of `leo blind` (single effects, pairs, none), the DFKI pendulum and one
XL330 servo; what was chosen on which is in docs/evidence.md.
"""

from dataclasses import asdict, dataclass
from math import inf, isfinite


@dataclass(frozen=True)
class Gates:
    """Gates of the selection and of the verdict; the report prints them with these lines."""

    noise_quantile: float = 0.999
    """Of the best gain of all candidates in draws of pure noise."""
    noise_times: float = 1.5
    """As much is what noise can give, whose size is known only roughly."""
    least_nats: float = 8.0
    """An effect must improve the prediction of what was left out by so much, whatever the draws of
    noise say [nats]."""
    least_errors: float = 2.0
    """And by so many standard errors, from how much the folds disagree."""
    material: float = 0.1
    """And by this share of what is left unexplained beyond noise: what is less may well be part of
    that; of the squared error, by which a set refutes another. Set on the four DFKI runs."""
    part: float = 0.01
    """Of what a set does to the prediction (mean square), that it must do beyond a smaller set:
    what does less is no answer to what is missing. Set on the free pendulum and on pairs 1000 to
    1008 of `leo blind`, where 0.02 lost a ripple."""
    far_times: float = 2.0
    """Unless it does so many times what the set is itself off by at the far end (the noise floor
    at least), which anybody sees: as much as `leo blind` counts for an effect of two."""
    price: float = 0.5
    """Of a parameter, in logs of the effective number of samples (0.5: Schwarz 1978)."""
    margin_nats: float = 5.0
    """Sets nearer than this to the best are rivals of it [nats] (5: odds of 150)."""
    told_nats: float = 15.0
    """What is further behind is not even named as a rival [nats]."""
    equal_nats: float = 0.5
    """Sets no further apart are one by two names, as fits end so far apart [nats]."""
    window_nats: float = inf
    """Most that one window may say for or against a hypothesis, for a dispersion of 1 [nats]."""
    turns: int = 60
    """Draws of left-out folds in which the choice is made again."""
    left_out: float = 0.1
    """Share of the folds left out of each turn."""
    stable: float = 0.9
    """Share of the turns that must choose an effect for it to be sure."""
    surely: float = 0.99
    """Confidence that another set has a smaller held-out error, for it to refute the choice;"""
    likely: float = 0.975
    """where the folds do not put it behind by `least_errors`: as sure as that. Set on the DFKI
    run by SAC: the folds are for viscous friction by 1.8 errors, held-out data against by 3.6."""
    unexplained: float = 1.6
    """Times the noise that may be left where nothing is missing (mean square)."""
    correlated: float = 1.3
    """Times the noise that may be left where it is correlated in time (mean square)."""
    correlation: float = 1.5
    """Times by which correlation in time must multiply the variance of what is left, for it to
    count as correlated."""
    share: float = 0.25
    """Of the error beyond noise that may be left where everything is explained. A larger set that
    leaves less than this of what a smaller one leaves counts even where both predict the same far
    ahead: a servo loop takes the error away before the end of a window."""
    far: float = 4.0
    """Times the noise (mean square) that matters however much was explained."""
    out_of_line: float = 2.0
    """Times the median loss that a window may count for in what is unexplained."""
    law_periods: float = 0.1
    """A law with so nearly a whole number of periods in a turn is a ripple, which is known."""
    many: int = 3
    """Of so many effects or more those below the noise floor are not sure: a robot is wrong in
    many smaller ways, of which one or two names are no account. Leaves the DFKI pendulum's two
    alone."""
    several: int = 3
    """Motors of a robot, from which on losses that most joints have are usual there: they stay in
    every set while most need them. Set on the TX40. From as many on, rounds know viscous and dry
    friction alone in short windows, and an effect must save more than a trifle: set on payload
    986002, SAPC's main study; of one joint XL330, DFKI and the free pendulum were worse for it."""
    least_floors: float = 1.0
    """What an effect must change the prediction by there, all others refitted [noise floors]: the
    size below which `leo blind --small` draws its small differences."""
    few_floors: float = 0.5
    """Of that, beside few other effects: as large as a single one of `leo blind` may seem, whose
    size is counted otherwise. Set on seeds 1000 to 1043 and arm `none` 14."""
    fewest_blocks: int = 3
    """Stretches of time of a recording that shows its own value, or of held-out data that refute a
    choice."""
    disagree: float = 0.5
    """Of a value, by which two recordings that exclude each other must differ for the answer not
    to be sure. Set on nothing: what a person would call another robot."""
    outside: float = 0.5
    """Share of the moving time that looks moved from outside, from which on no effect is named,"""
    nearly_all: float = 0.9
    """unless known effects leave no more than noise in this share of the windows."""
    fewest_windows: int = 12
    """Of data that can be tested; on the ground, those kept where none can be trusted."""
    least_motion: float = 8.0
    """Standard deviations of noise a window must swing to count as motion."""

    def to_json(self) -> dict[str, float | None]:
        """All of them by name; None stands for what has no limit."""
        return {name: value if isfinite(value) else None for name, value in asdict(self).items()}
