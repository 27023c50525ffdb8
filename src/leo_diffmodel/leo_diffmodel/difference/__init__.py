# SPDX-License-Identifier: Apache-2.0
"""The difference model: d(s, a) = s'_real - s'_model, learned where no named effect explains."""
