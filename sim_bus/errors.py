"""Errors of the simulated bus."""

from wamctl.arm.errors import UserError


class SimulatedBusError(UserError):
    """A bus that cannot be served; the message is the whole sentence."""

    exit_code = 4


class UnknownEffectError(UserError):
    """No such hidden effect; the message is the whole sentence."""

    exit_code = 2
