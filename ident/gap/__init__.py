"""Where simulation and measurement disagree, and which effect is missing."""
