# SPDX-License-Identifier: Apache-2.0
"""The run is sent to the robot: a button, and two more that ask whether it is meant."""

from __future__ import annotations

from bokeh.layouts import column, row
from bokeh.models import Button
from markupsafe import Markup

from leo_diffmodel.watch.live.beside import Beside, STOPPED
from leo_diffmodel.watch.live.sending import Sent
from leo_diffmodel.watch.next_run import NextRun
from leo_diffmodel.watch.page.look import CARD, said
from leo_msgs_py.errors import UserError

RECORDED = 'It is recorded into {}.'
NOT_RECORDED = 'It is not recorded: press Record first to keep what it shows.'


class SendView:
    """Follows the player and the question, whichever tab asked."""

    def __init__(self, next_run: NextRun, beside: Beside) -> None:
        self._next, self._beside = next_run, beside
        self._send = Button(label='', button_type='warning', width=200, name='send')
        self._yes = Button(
            label='Yes, move the robot', button_type='danger', width=200, name='yes, move'
        )
        self._no = Button(label='No', width=80, name='no, do not move')
        self._words = said(sizing_mode='stretch_width', name='sending')
        self._answers = row(self._yes, self._no)
        self._connect()
        self.root = column(
            row(self._send, self._answers),
            self._words,
            stylesheets=[CARD],
            sizing_mode='stretch_width',
        )
        self.refresh()

    def refresh(self) -> None:
        """Show what can be done now."""
        sending = self._beside.sending
        self._send.label = 'Stop the run' if sending.on else 'Send to the robot'
        self._send.visible = sending.on or bool(self._next.words)
        self._send.disabled = not sending.on and (sending.question is not None or self._stopped)
        self.root.visible = self._send.visible or bool(sending.words)
        self._answers.visible = sending.question is not None
        self._words.text = Markup('<b>{}</b>').format(self._asked())

    @property
    def _stopped(self) -> bool:
        return bool(self._beside.robot.condition.e_stopped)

    def _connect(self) -> None:
        self._send.on_click(self._pressed)
        self._yes.on_click(self._confirmed)
        self._no.on_click(self._refused)

    def _pressed(self) -> None:
        sending, plan = self._beside.sending, self._next.plan
        if sending.on:
            sending.stop()
        elif plan is not None and plan.run is not None and self._next.words:
            sending.ask(Sent(tuple(self._next.words), plan.run.name, plan.seconds))
        self.refresh()

    def _confirmed(self) -> None:
        try:
            self._beside.send()
        except (UserError, OSError) as error:
            self._beside.said = str(error)
        self.refresh()

    def _refused(self) -> None:
        self._beside.sending.no()
        self.refresh()

    def _asked(self) -> str:
        """The question; what the player is doing where there is none."""
        sending, recording = self._beside.sending, self._beside.recording
        if (run := sending.question) is None:
            return ' '.join(filter(None, [sending.words, STOPPED if self._stopped else '']))
        kept = RECORDED.format(recording.bag) if recording.on else NOT_RECORDED
        return f'The robot will move for {run.seconds:.0f} s: "{run.name}". {kept} Go on?'
