"""The arm with its drives: frames in, frames out, physics in between."""

from collections.abc import Container, Sequence

import numpy as np

from sim_bus.can_bus.frame import Frame
from sim_bus.node import MotorNode, Node
from sim_bus.plant.encoders import Encoders
from sim_bus.plant.plant import Plant
from wamctl.arm.arrays import Array


class SimulatedArm:
    """Drives and physics together.

    A stand holds the arm in its start pose until all drives have been enabled for the first time.

    Attributes:
        plant: the physics.
        encoders: what the motors' devices read.
        motors: one device per motor.
        nodes: all devices.
        deaf: devices that no frame reaches.
        mute: devices whose frames never leave them.

    Args:
        plant: the physics.
        encoders: what the motors' devices read.
        motors: one device per motor.
        others: devices without a motor.
        braking: drag of motors without power [N m s/rad], motor side, shape (n,).
    """

    def __init__(
        self,
        plant: Plant,
        encoders: Encoders,
        motors: Sequence[MotorNode],
        others: Sequence[Node],
        braking: Array,
    ) -> None:
        self.plant = plant
        self.motors = tuple(motors)
        self.nodes: tuple[Node, ...] = (*motors, *others)
        self.encoders = encoders
        self.deaf: set[Node] = set()
        self.mute: set[Node] = set()
        self._torque_share = np.ones(len(self.motors))
        self._braking = braking
        self._motor_torque = np.zeros(len(self.motors))
        self._drag = braking.copy()
        self._torques = [0.0] * len(self.motors)
        self._enabled = [False] * len(self.motors)
        self._motors = frozenset[Node](self.motors)
        self._handlers: list[Container[int]] = []
        self._index: dict[int, list[Node]] = {}
        plant.hold()

    @property
    def is_enabled(self) -> bool:
        """Whether all motors are driven."""
        return all(motor.is_enabled for motor in self.motors)

    def boot(self, time_ns: int) -> list[Frame]:
        """Power-on of all nodes."""
        return self._sent({node: node.boot(time_ns) for node in self.nodes})

    def receive(self, time_ns: int, frame: Frame) -> list[Frame]:
        """The answers of all nodes to a frame that has reached them, lowest identifier first."""
        listeners = self._listeners(frame.can_id)
        if not listeners:
            return []
        self._come_to(time_ns)
        answers = {node: node.receive(time_ns, frame) for node in listeners}
        self._drive_motors()
        return self._sent(answers)

    def overhear(self, time_ns: int, frame: Frame) -> list[Frame]:
        """The answers of all nodes to a frame of one of them."""
        listeners = self._listeners(frame.can_id)
        if not listeners:
            return []
        if not self._motors.isdisjoint(listeners):
            return self.receive(time_ns, frame)
        return self._sent({node: node.receive(time_ns, frame) for node in listeners})

    def tick(self, time_ns: int) -> list[Frame]:
        """Frames that are due by a time without any input."""
        if self.next_ns > time_ns:
            return []
        self._come_to(time_ns)
        frames = {n: n.tick(time_ns) for n in self.nodes if n.next_ns <= time_ns}
        self._drive_motors()
        return self._sent(frames)

    def run_physics(self, time_ns: int) -> None:
        """Let the arm move until a time, under the torques of the present."""
        self.plant.advance(time_ns, self._motor_torque, self._drag)

    def weaken(self, motor: int, share: float) -> None:
        """From now on only a share comes of a motor's torque; 1 in a healthy arm."""
        self._torque_share[motor] = share
        self._set_torques()

    @property
    def next_ns(self) -> int:
        """When `tick` is due at the earliest."""
        return min([node.next_ns for node in self.nodes])

    def _listeners(self, can_id: int) -> list[Node]:
        """The nodes that a frame concerns; a node takes new handlers when it listens otherwise."""
        handlers = [node.handlers for node in self.nodes]
        if handlers != self._handlers:
            self._handlers, self._index = handlers, {}
        listeners = self._index.get(can_id)
        if listeners is None:
            listeners = self._index[can_id] = [n for n in self.nodes if can_id in n.handlers]
        return [n for n in listeners if n not in self.deaf] if self.deaf else listeners

    def _come_to(self, time_ns: int) -> None:
        self.run_physics(time_ns)
        self.encoders.set_time(time_ns)

    def _sent(self, frames: dict[Node, list[Frame]]) -> list[Frame]:
        sent = [f for node, own in frames.items() if node not in self.mute for f in own]
        sent.sort(key=lambda f: f.can_id)
        return sent

    def _drive_motors(self) -> None:
        torques = [motor.motor_torque_nm for motor in self.motors]
        enabled = [motor.is_enabled for motor in self.motors]
        if torques != self._torques:
            self._torques = torques
            self._set_torques()
        if enabled != self._enabled:
            self._enabled = enabled
            self._drag = np.where(enabled, 0.0, self._braking)
            if self.plant.is_held and all(enabled):
                self.plant.release()

    def _set_torques(self) -> None:
        self._motor_torque = np.array(self._torques) * self._torque_share
