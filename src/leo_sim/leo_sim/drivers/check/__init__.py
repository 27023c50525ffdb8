# SPDX-License-Identifier: Apache-2.0
"""All trials of a driver, one after another, and what came of each."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

from leo_msgs_py.errors import one_line, UserError
from leo_sim.drivers.base import DriverBug, DriverFault, EndOfRun, NoAnswer, NotPossible
from leo_sim.drivers.check import contract, motion
from leo_sim.drivers.check.trial import Broken, LeftOut, Trial

PASSED, FAILED, LEFT_OUT = 'pass', 'FAIL', 'left out'

CHECKS: tuple[Callable[[Trial], None], ...] = (
    contract.info,
    contract.stop_first,
    contract.connect,
    contract.shapes,
    contract.stamps,
    contract.pace,
    contract.writing,
    contract.halting,
    contract.torque,
    motion.signs_and_units,
    motion.limits,
    motion.by_hand,
    contract.resetting,
    motion.unplugged,
    contract.stop_twice,
)

NEEDED = (contract.info, contract.connect, contract.shapes)  # without these the rest says nothing
CARELESS = (
    ArithmeticError,
    AttributeError,
    AssertionError,
    ImportError,
    LookupError,
    NameError,
    RuntimeError,
    TypeError,
    ValueError,
)
"""What code raises that was not meant to raise."""
WAITS = (
    'wait for an answer a part of a period at most, then raise TransientFault; in halt wait for '
    'nothing and take no lock that read or write holds'
)
TYPED = (
    'raise TransientFault for a lost packet, DriverFault for the end, UserError in connect; '
    'the node would end here'
)


@dataclass(frozen=True)
class Result:
    name: str
    verdict: str
    what: str
    mend: str = ''  # what to do about it


def examine(trial: Trial) -> list[Result]:
    results: list[Result] = []
    try:
        for check in CHECKS:
            result = _result(check, trial)
            results.append(result)
            if result.verdict == FAILED and (check in NEEDED or result.mend == WAITS):
                break
    finally:
        with suppress(DriverFault, OSError, *CARELESS):  # was said
            trial.driver.stop()
    return results


def _result(check: Callable[[Trial], None], trial: Trial) -> Result:
    name = check.__name__.replace('_', ' ')
    try:
        check(trial)
    except Broken as broken:
        return Result(name, FAILED, str(broken), broken.mend)
    except (LeftOut, NotPossible, EndOfRun) as why:
        return Result(name, LEFT_OUT, str(why))
    except UserError as error:
        return Result(name, FAILED, str(error), 'as it says')
    except NoAnswer as late:
        return Result(name, FAILED, str(late), WAITS)
    except DriverBug as bug:
        return Result(name, FAILED, str(bug), TYPED)
    except (DriverFault, OSError) as fault:
        return Result(
            name,
            FAILED,
            f'{type(fault).__name__}: {one_line(fault)}',
            'look at the device; the node would end here',
        )
    except CARELESS as error:
        return Result(name, FAILED, f'{type(error).__name__}: {one_line(error)}', TYPED)
    return Result(name, PASSED, (check.__doc__ or '').splitlines()[0])
