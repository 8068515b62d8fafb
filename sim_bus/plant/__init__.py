"""The physics of the arm: rigid bodies, dry friction, end stops, encoders."""
