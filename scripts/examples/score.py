"""A model against another recording. Usage: score.py MODEL LOG MOST_PERCENT."""

import sys

import ident

model_file, log, most = sys.argv[1:]
score = ident.score(ident.load_model(model_file), ident.Recording.from_bag(log))
print(f"{score.relative_error_percent:.2f} ± {score.sd_percent:.2f} % of the torque")
sys.exit(score.relative_error_percent > float(most))
