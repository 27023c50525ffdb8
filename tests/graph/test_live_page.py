# SPDX-License-Identifier: Apache-2.0
"""The page of leo watch beside a running robot."""

from collections.abc import Callable
import json
import signal
import subprocess
import time
from types import SimpleNamespace

from bokeh.client import pull_session
from bokeh.document import Document
from bokeh.events import ButtonClick
import numpy as np
import pytest
from rclpy.node import Node
from tests.commands import start
from tests.page import no_run
from tests.patience import PATIENCE, until

from leo_diffmodel.bags.recording import assembled, read_bag
from leo_diffmodel.bags.topic_map import TopicMap
from leo_diffmodel.next_run.run_file import Run, write_run
from leo_diffmodel.nodes.live_robot import live_robot
from leo_diffmodel.watch.live.commands import RecordingSwitch, TOO_LATE
from leo_diffmodel.watch.live.live import Live, STOPPED
from leo_diffmodel.watch.live.renewing import Renewing, Source
from leo_diffmodel.watch.next_run import Plan
from leo_diffmodel.watch.page.document import Page
from leo_diffmodel.watch.page.live import LiveTab
from leo_diffmodel.watch.state import State
from leo_msgs_py import topics
from leo_msgs_py.errors import UserError
from leo_msgs_py.node import join
from leo_msgs_py.terminal import leo_process
from leo_msgs_py.values import command_message
from leo_sim.common.worker import News
from leo_sim.model import Model

pytestmark = pytest.mark.graph

SOME = 20_000  # bytes of a bag that holds states
APART = 5.0  # between two commands [s]
SOURCE = Source(Model('pendulum'), TopicMap())
LONG = 4000  # control periods of a run that the e-stop ends
PARAMETERS = ['--ros-args', '-p', 'robot:=pendulum', '-p', 'noise:=[0.001, 0.03]']
ROBOT = ['run', 'leo_sim', 'robot', *PARAMETERS]
WATCH = ['watch', '--live', '--no-browser', '--json']


@pytest.fixture
def robot(spawn):
    return start(spawn, *ROBOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


@pytest.fixture
def live(robot, domain, tmp_path):
    with live_robot(10.0, []) as listener:
        found: list = []
        until(lambda: scene_of(listener, found), 'no scene')
        state = State(found[0])
        renewing = Renewing(SOURCE, state, listener.buffer.contents, lambda: listener.weights)
        running = Live(listener, RecordingSwitch(tmp_path / 'out'), renewing)
        finder = SimpleNamespace(busy=False, news=News())
        documents, run = [Document(), Document()], run_of(tmp_path)
        page = Page(state, finder, ['leo', 'add'], run)
        tabs = [LiveTab(document, page, running) for document in documents]
        found = {'robot': robot, 'live': running, 'state': state}
        yield SimpleNamespace(**found, tabs=tabs, documents=documents)
        running.sending.wait()
        renewing.end()
        running.recording.wait()


def run_of(folder) -> SimpleNamespace:
    robot = Model('pendulum').robot
    run = Run('steps', 'slow steps', np.full((LONG, 1), 0.5), np.ones(LONG, bool))
    plan = Plan((), robot, run)
    words = ['play', str(write_run(folder / 'run.csv', run, robot))]
    return no_run(plan=plan, words=words, recorded=words)


def scene_of(listener, found) -> bool:
    try:
        found.append(SOURCE.scene(listener.buffer.contents()))
    except UserError:
        time.sleep(0.5)
    return bool(found)


def click(live, name) -> None:
    document = live.documents[0]
    document.callbacks.trigger_event(ButtonClick(document.get_model_by_name(name)))


def commander() -> Callable[[], None]:
    """Sends one command now and then; between two the robot times out."""
    publisher, sent = join(Node('commander')).create_publisher(*topics.COMMANDS['voltage']), [0.0]

    def command() -> None:
        if publisher.get_subscription_count() and time.monotonic() - sent[0] > APART:
            sent[0] = time.monotonic()
            publisher.publish(command_message([1.0]))

    return command


def samples(live) -> int:
    return len(live.documents[1].get_model_by_name('live measured').data['t'])


def says(live, text) -> bool:
    live.live.look()
    for tab in live.tabs:
        tab._follow()
    return all(text in d.get_model_by_name('robot says').text for d in live.documents)


def test_windows_arrive_and_stop_and_recording_reach_the_robot_and_every_tab(live, tmp_path):
    first, command = live.state.scene, commander()
    until(lambda: command() or says(live, 'no command: timed out'), 'no time-out')
    until(lambda: live.live.look() or live.state.scene is not first, 'no new windows')
    click(live, 'record')
    until(lambda: says(live, f'recording {tmp_path}/out/run'))
    until(lambda: live.live.recording.size > SOME, 'nothing recorded')
    click(live, 'e-stop')
    until(lambda: says(live, 'e-stop: '), 'not stopped')
    click(live, 'release')
    until(lambda: not says(live, 'e-stop: '), 'not released')
    click(live, 'record')
    until(lambda: says(live, f'recorded {tmp_path}/out/run'))
    assert len(read_bag(tmp_path / 'out' / 'run', 'pendulum').episodes) == 2
    click(live, 'record')
    until(lambda: (tmp_path / 'out' / 'run_1').is_dir(), 'no second bag')


def applied(live) -> float:
    """The newest input that the robot says it applied [V]."""
    contents = live.live.robot.buffer.contents()
    recording = assembled(contents, SOURCE.model.robot, SOURCE.mapping)
    return float(recording.episodes[-1].inputs[-1, 0])


def moves(live) -> bool:
    """Whether a run moves the robot; a busy machine may answer too late, and is asked again."""
    if not live.live.sending.on:
        click(live, 'send')
        click(live, 'yes, move')
    return says(live, 'playing ') and applied(live) == 0.5


def test_a_run_is_sent_after_a_question_and_the_e_stop_ends_it(live):
    click(live, 'yes, move')
    assert says(live, TOO_LATE) and not live.live.sending.on
    click(live, 'send')
    assert 'not recorded' in live.documents[0].get_model_by_name('sending').text
    until(lambda: moves(live), 'not applied')
    click(live, 'e-stop')
    until(lambda: says(live, ' was stopped: ') and says(live, 'e-stop: '), 'not stopped')
    click(live, 'send')
    click(live, 'yes, move')
    assert says(live, STOPPED) and not live.live.sending.on
    until(lambda: says(live, 'e-stop: ') and applied(live) == 0.0, 'not at 0 V')
    live.live.sending.wait()


def test_a_robot_that_dies_is_said_and_what_was_measured_stays(live):
    until(lambda: not says(live, 'no state') and samples(live) > 200, 'too few samples')
    live.robot.send_signal(signal.SIGKILL)
    until(lambda: says(live, 'no state from the robot'))
    until(lambda: not live.live.look() and live.live.renewing._future is None)
    until(lambda: click(live, 'e-stop') or says(live, 'no /robot/e_stop service answers'))
    assert 'no /robot/e_stop service answers' in live.live.robot.stopped()
    assert samples(live) > 200 and live.state.scene.recordings


def test_the_command_serves_the_page_and_ends_with_the_signal(robot, spawn, domain):
    leo = start(spawn, *WATCH, '--model', 'pendulum', stdout=subprocess.PIPE)
    url = json.loads(leo.stdout.readline())['url']
    document = pull_session(url=url).document
    assert len(document.get_model_by_name('live measured').data['t']) > 100
    leo.send_signal(signal.SIGINT)
    assert leo.wait(PATIENCE) == 0 and robot.poll() is None


def refused(*words) -> str:
    command = leo_process(*WATCH, '--model', *words)
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)
    assert done.returncode == 2
    return done.stderr


@pytest.mark.parametrize(
    ('model', 'words'), [('pendulum', 'no robot is publishing joint_states'), ('nobody', 'nobody')]
)
def test_without_a_robot_or_a_model_it_ends_with_one_line(model, words, domain):
    error = refused(model, '--patience', '1')
    assert words in error and error.count('\n') == 1


def test_another_robot_than_the_models_is_refused_with_both_names(robot, domain):
    error = refused('torque_pendulum')
    said = "the running robot is 'pendulum', this is for 'torque_pendulum'"
    # on a busy machine progress comes before
    assert said in error.splitlines()[-1] and error.count('leo: error') == 1
