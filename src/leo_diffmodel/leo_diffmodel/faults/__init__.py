# SPDX-License-Identifier: Apache-2.0
"""What is wrong with a log: faults of a measurement with size, interval and evidence.

`catalogue.yaml` says what can be wrong, fault by fault; `find` looks for it: first in the
kinematics (`kinematics`, by `motion`: angle and speed are of one motion), which need no model,
then in the balance of torques (`dynamics`, by `balance`).
"""
