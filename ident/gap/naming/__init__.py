"""Which of the effects that help prediction are sure enough to be named."""
