"""The power side of a drive: CiA 402 states and torque."""

from sim_bus.canopen.dictionary import ObjectDictionary
from sim_bus.canopen.ds402 import CYCLIC_SYNCHRONOUS_TORQUE, State, Statusword, follow

MODE = (0x6060, 0)
ERROR_CODE = (0x603F, 0)
_CONTROLWORD = (0x6040, 0)
_MODE_DISPLAY = (0x6061, 0)
_SUPPORTED_MODES = (0x6502, 0)
_TARGET_TORQUE, _TORQUE_OFFSET = (0x6071, 0), (0x60B2, 0)
_MAX_TORQUE, _TORQUE_DEMAND = (0x6072, 0), (0x6074, 0)

_CST_BIT = 1 << (CYCLIC_SYNCHRONOUS_TORQUE - 1)
_VOLTAGE = int(Statusword.VOLTAGE_ENABLED)
_LIMIT = int(Statusword.INTERNAL_LIMIT)
_FOLLOWS = int(Statusword.FOLLOWS_COMMAND)


class MotorControl:
    """A torque-controlled motor behind its objects.

    Attributes:
        state: state of the CiA 402 machine.
        statusword: object 0x6041, without the bit `remote`, which is the communication's.
        torque_permille: torque that the motor makes, in per mille of 0x6076.
        is_enabled: whether the power stage drives the motor.
    """

    def __init__(self, objects: ObjectDictionary) -> None:
        self._values = objects.values
        self._is_powered = True
        self.reset()

    def reset(self) -> None:
        """As after power-on: switched off, no torque."""
        self._controlword = 0
        self._enter(State.SWITCH_ON_DISABLED)

    def accepts(self, mode: int) -> bool:
        """Whether 0x6060 may take a mode: none, or cyclic synchronous torque."""
        supports_torque = bool(self._values[_SUPPORTED_MODES] & _CST_BIT)
        return mode == 0 or (mode == CYCLIC_SYNCHRONOUS_TORQUE and supports_torque)

    @property
    def is_powered(self) -> bool:
        """Whether the supply voltage is there; without it no fault can be reset."""
        return self._is_powered

    @is_powered.setter
    def is_powered(self, is_powered: bool) -> None:
        self._is_powered = is_powered
        self._set_torque()

    def fail(self, code: int) -> None:
        """Fault reaction and fault: no torque from now on."""
        self._values[ERROR_CODE] = code
        self._enter(State.FAULT)

    def switch_off(self) -> None:
        """No torque; a fault stays."""
        self._values[_CONTROLWORD] = self._controlword = 0
        if self.state != State.FAULT:
            self._enter(State.SWITCH_ON_DISABLED)

    def act(self) -> bool:
        """Follow the objects that a PDO or SDO has written; true when a fault was reset."""
        values = self._values
        mode, controlword = values[MODE], values[_CONTROLWORD]
        if mode != values[_MODE_DISPLAY] and self.accepts(mode):
            values[_MODE_DISPLAY] = mode
        if controlword == self._controlword:  # the states follow its level: nothing new
            self._set_torque()
            return False
        before = self.state
        self._enter(follow(before, controlword, self._controlword, self._is_powered))
        self._controlword = controlword
        reset = before == State.FAULT and self.state != State.FAULT
        if reset:
            values[ERROR_CODE] = 0
        return reset

    def _enter(self, state: State) -> None:
        self.state = state
        self.is_enabled = state in (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE)
        self._set_torque()

    def _set_torque(self) -> None:
        values = self._values
        word = self.state | (_VOLTAGE if self._is_powered else 0)
        torque = 0
        if (
            self.state == State.OPERATION_ENABLED
            and values[_MODE_DISPLAY] == CYCLIC_SYNCHRONOUS_TORQUE
        ):
            wanted = values[_TARGET_TORQUE] + values[_TORQUE_OFFSET]
            most = values[_MAX_TORQUE]
            torque = max(-most, min(most, wanted))
            word |= _FOLLOWS if torque == wanted else _FOLLOWS | _LIMIT
        self.statusword = word
        self.torque_permille = values[_TORQUE_DEMAND] = torque
