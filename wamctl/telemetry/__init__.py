"""From the loop to the log and the display, through shared memory."""
