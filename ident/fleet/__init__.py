"""Many arms, many logs: each log reduced once, and what has changed in which arm since when."""
