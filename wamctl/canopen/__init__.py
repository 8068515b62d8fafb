"""CANopen (CiA 301, CiA 402) towards Puck 4 drives."""
