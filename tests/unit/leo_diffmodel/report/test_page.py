# SPDX-License-Identifier: Apache-2.0
"""The page from hand-made results: six verdicts, escapes, no network, whole or not at all."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.page import read

from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.compare.comparison import Comparison
from leo_diffmodel.compare.errors import Prediction
from leo_diffmodel.compare.torque import MissingTorque
from leo_diffmodel.compare.where import where
from leo_diffmodel.compare.windows import Windows
from leo_diffmodel.explain.explanation import Explanation
from leo_diffmodel.explain.settings import SETTINGS
from leo_diffmodel.explain.told import Told
from leo_diffmodel.outside.finding import Finding, WARNING
from leo_diffmodel.report.compared import comparison_page
from leo_diffmodel.report.explained import explanation_page
from leo_diffmodel.report.sections import missing as missing_section
from leo_diffmodel.report.sections import where as where_section
from leo_diffmodel.report.sections.verdict import MEANING
from leo_sim.description.robot import load_robot
from leo_sim.model import Model

STATES = [{'name': 'pivot', 'unit': 'rad'}, {'name': 'pivot rate', 'unit': 'rad/s'}]
PROVENANCE = {
    'bags': [{'path': 'bags/<run> & "1"', 'sha256': 'f00d'}],
    'robot': 'pendulum',
    'model_sha256': 'beef',
    'effects_in_model': [],
    'command': "leo explain 'bags/<run>' --model pendulum",
    'date': '2026-11-20T12:00:00+00:00',
    'python': '3.11.7',
    'versions': {'leo_sim': '0.1.0'},
    'seed': 0,
}
RIPPLE = {'name': 'torque_ripple', 'where': 'pivot', 'why': '1.0 nats, 12.7 are needed'}


@pytest.fixture(scope='module')
def model() -> Model:
    return Model(load_robot('pendulum'))


@pytest.fixture(scope='module')
def recording() -> Recording:
    t, flat = np.arange(200) * 0.01, np.zeros((200, 1))
    episode = Episode(t, flat, flat, flat, np.ones((200, 1), bool))
    return Recording(
        Path('bags/<run> & "1"'), 'f00d', ('pivot',), ('pivot',), 'voltage', 0.01, (episode,), {}
    )


@pytest.fixture(scope='module')
def missing() -> MissingTorque:
    rng = np.random.default_rng(0)
    q, dq, u = rng.uniform(-1, 1, (3, 120, 1)) * np.array([1.0, 8.0, 3.0])[:, None, None]
    held = [np.repeat(x[:, None], n, axis=1) for x, n in ((q, 6), (dq, 6), (u, 5))]
    windows = Windows(
        *held,
        np.ones((120, 5, 1), bool),
        np.full((120, 5), 0.01),
        np.arange(120) * 0.06,
        np.zeros(120, int),
        np.zeros(120, bool),
    )
    torque = -1e-4 * dq + 1e-5 * rng.standard_normal((120, 1))
    return MissingTorque(np.arange(120) * 0.06, torque, np.full((120, 1), 1e-5), q, dq, u, windows)


def explanation(verdict: str, model: Model, sentence: str = 'Sentence <1> & 2.') -> Explanation:
    run = {'next_run': 'Let it swing with the motors free.', 'not_testable': [RIPPLE]}
    told = (Told(sentence),)
    return Explanation(verdict, told, model, **run, provenance=PROVENANCE, seconds=0.1)


def comparison(missing: MissingTorque, model: Model, factor: float) -> Comparison:
    """Errors `factor` times the noise floor, at one step and further ahead."""
    seen = missing.windows.measured
    prediction = Prediction(missing.windows, seen + 0.01, np.full_like(seen, 1e-4))
    floor = [[0.002, 0.05], [0.003, 0.06]]
    seconds = (0.03, 0.6)

    def table(k: float) -> list[dict]:
        return [
            {'steps': n, 'seconds': s, 'rmse': [k * e for e in f]}
            for n, s, f in zip((1, 20), seconds, floor, strict=True)
        ]

    data = {
        'states': STATES,
        'step_seconds': 0.03,
        'one_step': {'rmse': [factor * e for e in floor[0]]},
        'horizon': table(factor),
        'noise_floor': {'one_step': {'rmse': floor[0]}, 'horizon': table(1.0)},
        'budget': {'explained': 0.7, 'unexplained': 0.2, 'noise': 0.1},
        'seconds': 0.4,
        'provenance': PROVENANCE,
    }
    return Comparison(data, missing, where(missing, model), prediction)


@pytest.mark.parametrize('verdict', MEANING)
def test_every_verdict_makes_a_page(verdict, model, recording):
    links, text = read(explanation_page(explanation(verdict, model), [recording]))
    assert links.urls == [] and links.scripts == 0
    assert verdict in text and 'Sentence <1> & 2.' in text
    # what makes data testable is said in the sentence
    assert ('Let it swing with the motors free.' in text) == (verdict != 'untestable')
    assert 'torque_ripple' in text and '12.7 are needed' in text
    assert 'What this data could not test' in text
    for origin in ('f00d', 'beef', PROVENANCE['date'], 'runtime0.10 s', 'leo_sim 0.1.0'):
        assert origin in text, origin


def test_the_page_of_recordings_that_were_moved_from_outside(model, recording):
    pushed = Finding('push', WARNING, 'pivot: a push', where=((1.0, 2.0),))
    gates = SETTINGS.gates.to_json()
    answer = replace(
        explanation('unknown', model), not_testable=[], settings=gates, left_out=([pushed],)
    )
    bags = [recording, replace(recording, path=Path('bags/other'))]
    _, text = read(explanation_page(answer, bags))
    assert 'not the robot’s own' in text and '--keep' in text and 'pivot: a push' in text
    assert 'least_nats' in text and 'whatever the draws of noise say' in text
    assert 'Every effect of the catalogue' not in text


def test_what_came_from_outside_is_escaped(model, recording):
    hostile = '<script>alert(1)</script> coulomb_friction:pivot'
    command = 'leo watch "<b>" --model pendulum'
    html = explanation_page(explanation('named', model, hostile), [recording], command)
    links, text = read(html)
    assert links.scripts == 0 and hostile in text and command in text
    assert '<run>' not in html and 'bags/<run> & "1"' in text


def test_the_comparison_is_a_sentence_of_numbers_and_axes_have_units(model, recording, missing):
    html = comparison_page(comparison(missing, model, 4.0), [recording], model)
    links, text = read(html)
    assert links.urls == [] and links.scripts > 0
    text = text.replace('\u00a0', ' ')
    assert '4.0 × noise' in text and '4.0 times what noise alone explains' in text
    assert '0.00800 rad (pivot)' in text and '0.200 rad/s (pivot rate)' in text
    assert 'explained by the model 70 %' in text and 'noise 10 %' in text
    for unit in ('[rad]', '[rad/s]', '[V]', '[s]', 'N m', 'Hz'):
        assert unit in text, unit
    axes = 'rms error of pivot [rad]', 'missing torque [mN m]', 'prediction horizon [s]'
    variables = 'pivot speed [rad/s]', 'pivot angle [rad]', 'pivot voltage [V]'
    for axis in (*axes, *variables):
        assert f'"{axis}"' in html, axis


def test_a_model_at_the_noise_floor_is_said_to_be(model, recording, missing):
    quiet = replace(missing, torque=0.1 * missing.spread)
    _, text = read(comparison_page(comparison(quiet, model, 1.0), [recording], model))
    assert 'which is what noise alone explains' in text
    assert 'No place stands out' in text


def test_an_angle_of_many_turns_is_folded_into_one(model, missing):
    turning = replace(missing, q=np.linspace(0, 300, len(missing.q))[:, None])
    plot = missing_section.section(turning, model.robot).figures[1]
    assert plot.xaxis.axis_label == 'pivot angle within a turn [rad]'
    drawn = np.concatenate(
        [r.data_source.data['x'] for r in plot.renderers if len(r.data_source.data['x']) > 2]
    )
    assert np.abs(drawn).max() <= np.pi


def test_the_heat_map_has_a_strip_for_each_variable(missing, model, recording):
    values = where_section.section(where(missing, model), model, [recording]).values
    [joint] = values['joints']
    assert joint['name'] == 'pivot' and joint['share'] == '100 %'
    names = [s['name'] for s in joint['strips']]
    assert names == ['speed', 'direction', 'load', 'angle', 'input', 'time']
    fast = joint['strips'][0]['cells']
    assert [c['shade'] for c in fast] == sorted(c['shade'] for c in fast)
    assert all('of the error in' in c['tip'] and 'of stall' in c['tip'] for c in fast)
    assert values['worst'][0]['variable'] == 'speed' and 'rad/s' in values['worst'][0]['range']
    assert values['worst'][0]['windows'].count(' s') == 3
