"""One module for each command: check, bench, monitor, home, excite."""
