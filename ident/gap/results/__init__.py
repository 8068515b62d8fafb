"""The results of a search: verdict, estimates, errors, the model with its effects."""
