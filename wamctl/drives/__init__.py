"""The interface to motor controllers, and the CAN bus."""
