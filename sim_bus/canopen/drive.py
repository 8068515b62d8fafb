"""A CANopen drive after the Puck 4: network management, SYNC, PDOs and emergencies (CiA 301)."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from sim_bus.can_bus.frame import Frame, carried_length
from sim_bus.canopen import pdo
from sim_bus.canopen.dictionary import Abort, Description, Getter, Key, ObjectDictionary, SdoAbort
from sim_bus.canopen.ds402 import Statusword
from sim_bus.canopen.emergency import ErrorCode, Errors
from sim_bus.canopen.motor import MODE, MotorControl
from sim_bus.canopen.nmt import Command, Nmt
from sim_bus.canopen.pdo import Pdo, Values
from sim_bus.canopen.process_data import NEVER_NS, ProcessData
from sim_bus.canopen.sdo import SdoServer

Handler = Callable[[bytes], None]

_MS = 1_000_000
_REMOTE = int(Statusword.REMOTE)


@dataclass(frozen=True)
class DriveSettings:
    """Settings that differ between drives of one type.

    Attributes:
        node_id: 1 to 127.
        rated_torque_mnm: object 0x6076.
        serial: object 0x1018:4.
        fd: whether the drive sends CAN FD frames, and takes PDOs of up to 64 bytes.
    """

    node_id: int
    rated_torque_mnm: int
    serial: int
    fd: bool = False


class CanopenDrive:
    """A drive on a bus: frames in, frames out; times are arguments [ns].

    Attributes:
        node_id: its number.
        handlers: what it does with a frame, by identifier.
        next_ns: when `tick` is due at the earliest.
        objects: its object dictionary.
        errors: its present errors.
        motor: its power side.

    Args:
        description: what its EDS says.
        settings: what the EDS does not say.
        position: gives the position of the present [counts].
        speed: gives the velocity of the present [counts/s].
    """

    def __init__(
        self, description: Description, settings: DriveSettings, position: Getter, speed: Getter
    ) -> None:
        fixed: dict[Key, int] = {
            (0x6076, 0): settings.rated_torque_mnm,
            (0x1018, 4): settings.serial,
        }
        live: dict[Key, Getter] = {
            (0x6041, 0): self._statusword,
            (0x6064, 0): position,
            (0x606C, 0): speed,
            (0x6078, 0): lambda: self.motor.torque_permille,
        }
        self.node_id = settings.node_id
        self.objects = ObjectDictionary(description, fixed, live)
        self.errors = Errors(self.objects)
        self.motor = MotorControl(self.objects)
        self._fd = settings.fd
        self._longest = 64 if settings.fd else 8
        self._pdos = ProcessData(self.objects, self._longest)
        self._torque_step_nm = settings.rated_torque_mnm * 1e-6
        self._sdo = SdoServer(self.objects.read, self._write)
        self._outbox: list[Frame] = []
        self._now = 0
        self._go_pre_operational()

    def boot(self, time_ns: int) -> list[Frame]:
        """Power-on: default values and the boot-up message."""
        self._now = time_ns
        self._reset(0xFFFF)
        return self._sent()

    def receive(self, time_ns: int, frame: Frame) -> list[Frame]:
        """The answers to a frame."""
        handler = self.handlers.get(frame.can_id)
        if handler is None:
            return []
        self._now = time_ns
        handler(frame.data)
        return self._sent()

    def tick(self, time_ns: int) -> list[Frame]:
        """Frames that are due without any input: heartbeat, event timers, SYNC watchdog."""
        self._now = time_ns
        if time_ns >= self._heartbeat_ns:
            self._emit(0x700 + self.node_id, bytes([self.nmt]))
            self._heartbeat_ns += self.objects.values[0x1017, 0] * _MS
        if time_ns >= self._sync_deadline_ns():
            self._fail(ErrorCode.SYNC_LOSS)
        for p in self._pdos.timed_out(time_ns):
            self._transmit(p)
        self._plan()
        return self._sent()

    def fail(self, time_ns: int, code: int) -> list[Frame]:
        """Raise a fault; its emergency message."""
        self._now = time_ns
        self._fail(code)
        return self._sent()

    def warn(self, time_ns: int, code: int) -> list[Frame]:
        """Raise an error without a fault; its emergency message."""
        self._now = time_ns
        self._emergency(self.errors.enter(code))
        return self._sent()

    def recover_from_bus_off(self, time_ns: int) -> list[Frame]:
        """Back on the bus: a fault where 0x2405 asks for it, else an emergency message alone."""
        code = ErrorCode.BUS_OFF_RECOVERED
        return (
            self.fail(time_ns, code) if self.objects.values[0x2405, 0] else self.warn(time_ns, code)
        )

    @property
    def motor_torque_nm(self) -> float:
        """Torque that the motor makes [N m]."""
        return self.motor.torque_permille * self._torque_step_nm

    @property
    def is_enabled(self) -> bool:
        """Whether the power stage drives the motor."""
        return self.motor.is_enabled

    # Network management

    def _boot(self) -> None:
        self._go_pre_operational()
        self._emit(0x700 + self.node_id, b"\0")

    def _go_pre_operational(self, nmt: Nmt = Nmt.PRE_OPERATIONAL) -> None:
        self.nmt = nmt
        self._pdos.stop()
        self._watch_ns = 0
        self._restart_heartbeat()
        self._route()

    def _go_operational(self) -> None:
        self.nmt = Nmt.OPERATIONAL
        self._pdos.start(self._now)
        self._route()
        self._plan()

    def _route(self) -> None:
        self.handlers: dict[int, Handler] = {0x000: self._on_nmt}
        if self.nmt != Nmt.STOPPED:
            self.handlers[0x600 + self.node_id] = self._on_sdo
        if self.nmt == Nmt.OPERATIONAL:
            self.handlers[self.objects.values[0x1005, 0] & 0x7FF] = self._on_sync
            for p in self._pdos.receiving:
                self.handlers[p.cob_id] = partial(self._on_rpdo, p)

    def _on_nmt(self, data: bytes) -> None:
        if len(data) != 2 or data[1] not in (0, self.node_id):
            return
        if data[0] == Command.START and self.nmt != Nmt.OPERATIONAL:
            self._go_operational()
        elif data[0] == Command.STOP:
            self.motor.switch_off()
            self._go_pre_operational(Nmt.STOPPED)
        elif data[0] == Command.ENTER_PRE_OPERATIONAL:
            self.motor.switch_off()
            self._go_pre_operational()
        elif data[0] == Command.RESET_NODE:
            self._reset(0xFFFF)
        elif data[0] == Command.RESET_COMMUNICATION:
            self._reset(0x1FFF)

    def _reset(self, last_index: int) -> None:
        self.objects.reset(0x1000, last_index)
        self.errors.leave_all()
        self.motor.reset()
        self._boot()

    def _restart_heartbeat(self) -> None:
        period_ms = self.objects.values[0x1017, 0]
        self._heartbeat_ns = self._now + period_ms * _MS if period_ms else NEVER_NS
        self._plan()

    def _plan(self) -> None:
        # SYNC moves its deadline on without coming here: then `tick` is early and finds nothing.
        self.next_ns = min(self._heartbeat_ns, self._sync_deadline_ns(), self._pdos.next_ns)

    # Process data

    def _on_sync(self, data: bytes) -> None:
        self._watch_ns = self._now
        for p in self._pdos.at_sync():
            self._transmit(p)
        for values in self._pdos.latched():
            self._apply(values)

    def _on_rpdo(self, p: Pdo, data: bytes) -> None:
        size = p.mapping.layout.size
        expected = carried_length(size, self._fd)
        if len(data) != expected:
            self._complain(ErrorCode.PDO_TOO_SHORT, len(data) < size)
            self._complain(ErrorCode.PDO_TOO_LONG, len(data) > expected)
            if len(data) < size:
                return
        elif self.errors.present:
            self._complain(ErrorCode.PDO_TOO_SHORT, False)
            self._complain(ErrorCode.PDO_TOO_LONG, False)
        values = self._pdos.receive(p, data[:size])
        if values is not None:
            self._apply(values)

    def _complain(self, code: int, is_present: bool) -> None:
        self._emergency(self.errors.enter(code) if is_present else self.errors.leave(code))

    def _apply(self, values: Values) -> None:
        self.objects.values.update(values)
        self._act()

    def _transmit(self, p: Pdo) -> None:
        self._emit(p.cob_id, p.mapping.pack())

    def _act(self) -> None:
        was_enabled = self.motor.is_enabled
        if self.motor.act():
            self._emergency(self.errors.leave_all())
        if self.motor.is_enabled and not was_enabled:
            self._watch_ns = self._now
            self._plan()

    def _fail(self, code: int) -> None:
        self.motor.fail(code)
        self._emergency(self.errors.enter(code))

    def _statusword(self) -> int:
        return self.motor.statusword | (_REMOTE if self.nmt == Nmt.OPERATIONAL else 0)

    def _sync_deadline_ns(self) -> int:
        timeout_ms = self.objects.values[0x2406, 0]
        if timeout_ms == 0 or not self.motor.is_enabled:
            return NEVER_NS
        return self._watch_ns + timeout_ms * _MS

    # Service data

    def _on_sdo(self, data: bytes) -> None:
        response = self._sdo.answer(data)
        if response is not None:
            self._emit(0x580 + self.node_id, response)

    def _write(self, key: Key, data: bytes) -> None:
        value = self.objects.decode(key, data)
        if pdo.is_pdo_object(key[0]):
            if self.nmt != Nmt.PRE_OPERATIONAL:
                raise SdoAbort(Abort.DEVICE_STATE)
            pdo.check_write(self.objects, key, value, self._longest)
        if key == MODE and not self.motor.accepts(value):
            raise SdoAbort(Abort.VALUE_RANGE)
        if key == (0x1003, 0):
            if value:
                raise SdoAbort(Abort.VALUE_RANGE)
            self.errors.clear_history()
        self.objects.values[key] = value
        if key == (0x1017, 0):
            self._restart_heartbeat()
        elif key == (0x1005, 0):
            self._route()
        elif key[0] >= 0x6000:
            self._act()
        self._plan()

    # Sending

    def _emergency(self, message: bytes | None) -> None:
        cob_id = self.objects.values[0x1014, 0]
        if message is not None and self.nmt != Nmt.STOPPED and not cob_id & 0x8000_0000:
            self._emit(cob_id & 0x7FF, message)

    def _emit(self, can_id: int, data: bytes) -> None:
        carried = data.ljust(carried_length(len(data), self._fd), b"\0")
        self._outbox.append(Frame(can_id, carried, self._fd))

    def _sent(self) -> list[Frame]:
        sent, self._outbox = self._outbox, []
        return sent
