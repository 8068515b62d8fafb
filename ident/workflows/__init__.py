"""Each command from files to files: recordings are read, results written."""
