# SPDX-License-Identifier: Apache-2.0
"""Put the channels of a recording right as a topic map says: units, zeros, late ones, time."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from leo_msgs_py.errors import UserError

from .episode import Episode, Recording
from .held import average
from .states import in_our_units
from .topic_map import JointMap, TopicMap
from .types import at_rows


def mended(recording: Recording, mapping: TopicMap) -> Recording:
    """A recording that was read without this map, as with it; but for topics and names."""
    joints = [mapping.joint(name) for name in recording.joints]
    if recording.rates != 'measured':  # they follow from the angles, and from time
        joints = [
            j.model_copy(update={'speed_scale': j.scale / mapping.time_scale, 'speed_zero': 0.0})
            for j in joints
        ]
    episodes = []
    for e in recording.episodes:
        q, dq, effort = in_our_units((e.q, e.dq, e.effort), joints)
        inputs = mapping.inputs(e.inputs, recording.actuators, recording.input)
        episodes.append(replace(e, q=q, dq=np.asarray(dq), effort=effort, inputs=inputs))
    return on_time(replace(recording, episodes=tuple(episodes)), mapping)


def on_time(recording: Recording, mapping: TopicMap) -> Recording:
    """A recording with each channel when it was measured, or acted, and time as it went by."""
    joints = [mapping.joint(name) for name in recording.joints]
    if recording.input == 'position':
        goals = [name for name in recording.actuators if mapping.joint(name).goal_is_angle]
        recording = _with_goals_for_angles(recording, goals)
        joints = [m.model_copy(update={'speed': 'none'}) if m.goal_is_angle else m for m in joints]
    late = any(j.speed_late or j.speed == 'none' for j in joints)
    inputs_late = [mapping.input_late + mapping.joint(m).input_late for m in recording.actuators]
    if not (late or mapping.time_scale != 1 or any(inputs_late)):
        return recording
    found = [_on_time(e, joints, inputs_late, mapping.time_scale) for e in recording.episodes]
    episodes = tuple(e for e in found if len(e.t) > 1)
    if not episodes:
        raise UserError(f'{recording.path}: no episode is longer than its channels are late')
    absent = all(j.speed == 'none' for j in joints)
    return replace(
        recording,
        episodes=episodes,
        rates='absent' if absent else recording.rates,
        command_period=recording.command_period * mapping.time_scale,
    )


def _with_goals_for_angles(recording: Recording, joints: Sequence[str]) -> Recording:
    episodes = []
    for e in recording.episodes:
        q, inputs = e.q.copy(), e.inputs.copy()
        for name in joints:
            j, a = recording.joints.index(name), recording.actuators.index(name)
            q[:, j], inputs[:, a] = e.inputs[:, a], e.q[:, j]
        episodes.append(replace(e, q=q, inputs=inputs))
    return replace(recording, episodes=tuple(episodes)) if joints else recording


def with_inputs_late(e: Episode, seconds: Sequence[float]) -> Episode:
    """The episode with each input acting so much later (A,); earlier where negative."""
    stamps = np.round(e.t * 1e9).astype(np.int64)
    inputs, enabled = e.inputs.astype(float), e.enabled.copy()
    for a, late in enumerate(seconds):
        if late:
            later = stamps + round(late * 1e9)
            early = np.r_[min(int(stamps[0]), int(later[0])) - 1, later]
            both = np.stack([e.inputs[:, a], e.enabled[:, a].astype(float)], axis=1)
            inputs[:, a], on = average(stamps, early, np.vstack([both[:1], both])).T
            enabled[:, a] = on > 0.5
    return replace(e, inputs=inputs, enabled=enabled)


def _on_time(
    e: Episode, joints: Sequence[JointMap], inputs_late: Sequence[float], time_scale: float
) -> Episode:
    e = with_inputs_late(e, inputs_late)
    dq, last = e.dq.copy(), e.t[-1]
    known = np.ones(len(e.t), dtype=bool)
    for j, joint in enumerate(joints):
        if joint.speed == 'none':
            dq[:, j] = np.gradient(e.q[:, j], e.t * time_scale) if len(e.t) > 1 else 0.0
        elif joint.speed_late:
            at = e.t + joint.speed_late
            dq[:, j] = np.interp(at, e.t, e.dq[:, j])
            known &= (at >= e.t[0]) & (at <= last)
    kept = at_rows(replace(e, dq=dq), known)
    return replace(kept, t=kept.t * time_scale)
