# SPDX-License-Identifier: Apache-2.0
"""One servo: its control table, what it allows, what its motor does, its bus watchdog.

Source: ROBOTIS e-Manual, https://emanual.robotis.com/docs/en/dxl/x/xm430-w210/
"""

from leo_sim.description import servos

SIZE = 147  # bytes of the control table that are here
FAILED, RANGE, LIMIT, ACCESS = 1, 4, 6, 7  # errors in a status
ALERT = 0x80  # added to a status while the register hardware_error_status is not 0

POSITION_MODES = {'dynamixel': (3, 4), 'feetech': (0,)}
"""Values of operating_mode in which it follows a goal position; Dynamixel's 3 within one turn."""
GOALS = ('goal_pwm', 'goal_current', 'goal_velocity', 'goal_position')
LIMITS = {'goal_pwm': 'pwm_limit', 'goal_current': 'current_limit'}


class Servo:
    """A servo's registers and their rules.

    Before torque is on, its goal is the whole PWM, what the register holds in the modes where it
    is a limit, and position 0. It follows a goal position at once: profiles are registers only.
    """

    def __init__(self, number: int, model: servos.ServoModel) -> None:
        self.model = model
        self._registers = model.registers
        self._memory = bytearray(SIZE)
        for register in self._registers.values():
            self._store(register, register.initial)
        self.set('id', number)
        self.set('model_number', model.number)
        self._heard = 0.0
        self.restart()

    def get(self, name: str) -> int:
        register = self._registers[name]
        return register.decode(bytes(self._memory[register.address : register.end]))

    def set(self, name: str, value: int) -> None:
        self._store(self._registers[name], value)

    def restart(self) -> None:
        """What a loss of power does: RAM as at the start, torque off."""
        for register in self._registers.values():
            if not register.kept:
                self._store(register, register.initial)
        self.set('goal_pwm', self.get('pwm_limit'))
        self.set('present_temperature', 30)

    def read(self, address: int, length: int) -> tuple[int, bytes]:
        if address + length > SIZE:
            return self.error(RANGE), b''
        return self.error(), bytes(self._memory[address : address + length])

    def write(self, address: int, data: bytes) -> int:
        """The error for a write instruction; all of it is stored or nothing."""
        values = {
            name: r.decode(data[r.address - address :])
            for name, r in self._registers.items()
            if address <= r.address and r.end <= address + len(data)
        }
        if not values:
            return self.error(ACCESS)
        for name, value in values.items():
            if error := self._objection(name, value):
                return self.error(error)
        for name, value in values.items():
            self.set(name, value)
        return self.error()

    def hear(self, now: float) -> None:
        self._heard = now

    def watch(self, now: float) -> None:
        limit = self.get('bus_watchdog') * servos.WATCHDOG_UNIT
        if limit > 0 and self.get('torque_enable') and now - self._heard > limit:
            self._stop()
            self.set('bus_watchdog', servos.EXPIRED)

    def _stop(self) -> None:
        """No PWM, current or speed; a servo that follows a goal position stays where it is."""
        if self.goal is not None:
            self.set('goal_position', self.get('present_position'))
            return
        for name in GOALS[:3]:
            if name in self._registers:
                self.set(name, 0)

    def fail(self, bits: int) -> None:
        """A hardware error: in every status; those in `shutdown` take the torque off."""
        self.set('hardware_error_status', self.get('hardware_error_status') | bits)
        if bits & self.get('shutdown'):
            self.set('torque_enable', 0)

    def error(self, code: int = 0) -> int:
        return code | (ALERT if self.get('hardware_error_status') else 0)

    @property
    def pwm(self) -> float | None:
        """Share of the supply on the motor, -1 to 1; None where PWM is not what is controlled."""
        if self.get('operating_mode') != servos.MODES[self.model.family]['goal_pwm']:
            return None
        return self.get('goal_pwm') / self.model.pwm_of_supply

    @property
    def current(self) -> float | None:
        """The current [A] it holds; None where current is not what is controlled."""
        if self.get('operating_mode') != servos.CURRENT_MODE:
            return None
        return self.get('goal_current') * self.model.current_unit

    @property
    def goal(self) -> int | None:
        """The position it goes to, counts; None where position is not what is controlled."""
        if self.get('operating_mode') not in POSITION_MODES[self.model.family]:
            return None
        return self.get('goal_position')

    def _objection(self, name: str, value: int) -> int:
        register = self._registers[name]
        if not register.writable or (register.kept and self.get('torque_enable')):
            return ACCESS
        if name in GOALS and self.get('bus_watchdog') == servos.EXPIRED:
            return RANGE
        if name in LIMITS and abs(value) > self.get(LIMITS[name]):
            return LIMIT
        if name == 'goal_position' and not self._reaches(value):
            return LIMIT
        if name == 'torque_enable' and self.get('hardware_error_status') & self.get('shutdown'):
            return FAILED if value else 0
        return RANGE if value not in _ALLOWED.get(name, (value,)) else 0

    def _reaches(self, goal: int) -> bool:
        if self.get('operating_mode') == POSITION_MODES['dynamixel'][0]:
            return self.get('min_position_limit') <= goal <= self.get('max_position_limit')
        return abs(goal) <= servos.FAR

    def _store(self, register: servos.Register, value: int) -> None:
        self._memory[register.address : register.end] = register.encode(value)


_ALLOWED = {
    'torque_enable': range(2),
    'bus_watchdog': range(128),
    'status_return_level': range(3),
    'operating_mode': (servos.CURRENT_MODE, 1, 3, 4, 5, servos.PWM_MODE),
    'pwm_limit': range(886),
    'return_delay_time': range(255),
    'id': range(253),
}
