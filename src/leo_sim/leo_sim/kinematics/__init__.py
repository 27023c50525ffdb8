# SPDX-License-Identifier: Apache-2.0
"""Where the links of a robot are at given angles, and what a walker looks at."""
