"""A model for other programs. Usage: export.py MODEL FILE FORMAT (urdf, mjcf, c or python)."""

import sys

import ident

model_file, file, to = sys.argv[1:]
for sentence in ident.export_model(ident.load_model(model_file), file, to):
    print(sentence)
