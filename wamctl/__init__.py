"""Drive a torque-controlled arm over CAN and record the experiment."""
