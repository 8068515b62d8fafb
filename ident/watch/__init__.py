"""Whether a trusted model still explains an arm, while its log is being written."""
