"""Barrett's own Puck protocol, which classic WAMs (P1 and P2 Pucks) speak instead of CANopen."""
