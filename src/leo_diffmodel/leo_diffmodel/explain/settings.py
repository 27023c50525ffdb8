# SPDX-License-Identifier: Apache-2.0
"""Every gate of explain in one place: what it decides, its unit and why it stands where it does.

Set on seeds 1000 to 1035 of `leo blind` (single effects, pairs, none), the DFKI pendulum and one
XL330 servo; what was chosen on which is in docs/evidence.md.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass


@dataclass(frozen=True)
class Settings:
    """Gates of the selection and of the verdict.

    Attributes:
        noise_quantile: of the best gain of all candidates in draws of pure noise;
        noise_times: as much is what noise can give, whose size is known only roughly.
        least_nats: an effect must improve the prediction of what was left out by so much, whatever
            the draws of noise say [nats].
        least_errors: and by so many standard errors, from how much the folds disagree.
        material: and by this share of what is left unexplained beyond noise: what is less may
            well be part of that.
        part: of what a set does to the prediction (mean square), that it must do beyond a smaller
            set: what does less is no answer to what is missing;
        far_times: unless it does so many times what the set is itself off by at the far end (the
            noise floor at least), which anybody sees.
        price: of a parameter, in logs of the effective number of samples (0.5: Schwarz 1978).
        margin_nats: sets nearer than this to the best are rivals of it [nats] (5: odds of 150).
        told_nats: what is further behind is not even told as a rival [nats].
        equal_nats: sets no further apart are one thing by two names, as fits end so far apart.
        width: best sets of a size that are extended by further effects.
        singles: effects fitted on top of a set, those that a linear scan finds best.
        wholes: whole numbers of a parameter (periods of a ripple) from which it is fitted: beside
            what else is missing, the best of a scan can be wrong.
        pairs: pairs of effects fitted on top of a set at once, found in the same way;
        first_pairs: and on top of the model as given, of the dozen leading effects, so that two
            effects are compared whatever leads alone.
        most_effects: at most so many names beside each other.
        turns: draws of left-out folds in which the choice is made again.
        left_out: share of the folds left out of each turn.
        stable: share of the turns that must choose an effect for it to be sure.
        unexplained: times the noise that may be left where nothing is missing (mean square).
        correlated: the same where what is left is correlated in time,
        correlation: which it is where that multiplies its variance by so much.
        share: of the error beyond noise that may be left where everything is explained.
        far: times the noise (mean square) that matters however much was explained.
        out_of_line: times the median loss that a window may count for in what is unexplained.
        law_periods: a law with so nearly a whole number of periods in a turn is a ripple, which
            is known.
        many: of so many effects or more those below the noise floor are not sure: a robot is
            wrong in many smaller ways, of which one or two names are no account.
        least_floors: what an effect must change the prediction by there, all others refitted
            [noise floors].
        fewest_blocks: stretches of time of a recording that tells its own value.
        disagree: of a value, by which two recordings that exclude each other must differ for the
            answer not to be sure.
        outside: share of the moving time moved from outside from which on no effect is named.
        fewest_windows: of data that can be tested.
        least_motion: standard deviations of noise a window must swing to count as motion.
    """

    noise_quantile: float = 0.999
    noise_times: float = 1.5
    least_nats: float = 8.0
    least_errors: float = 2.0
    material: float = 0.1
    part: float = 0.01
    far_times: float = 2.0
    price: float = 0.5
    margin_nats: float = 5.0
    told_nats: float = 15.0
    equal_nats: float = 0.5
    width: int = 2
    singles: int = 6
    wholes: int = 3
    pairs: int = 2
    first_pairs: int = 10
    most_effects: int = 8
    turns: int = 60
    left_out: float = 0.1
    stable: float = 0.9
    unexplained: float = 1.6
    correlated: float = 1.3
    correlation: float = 1.5
    share: float = 0.25
    far: float = 4.0
    out_of_line: float = 2.0
    law_periods: float = 0.1
    many: int = 3
    least_floors: float = 1.0
    fewest_blocks: int = 3
    disagree: float = 0.5
    outside: float = 0.5
    fewest_windows: int = 12
    least_motion: float = 8.0

    def to_json(self) -> dict[str, float]:
        """All of them by name."""
        return asdict(self)


SETTINGS = Settings()
