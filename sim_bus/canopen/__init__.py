"""A CANopen drive after the Puck 4: frames in, frames out, time as an argument."""
