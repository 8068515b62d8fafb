"""What can go wrong with classic Pucks; each message is one whole sentence."""

from wamctl.errors import BusError


class FrameError(BusError):
    """A frame, or a value for one, that the protocol does not allow."""


class PropertyError(BusError):
    """A property that a Puck's firmware does not have."""
