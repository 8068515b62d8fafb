"""One simulated CANopen drive: frames in, frames out, with the time as an argument."""
