"""The CAN bus: frames, their length, arbitration, and the programs that are connected."""
