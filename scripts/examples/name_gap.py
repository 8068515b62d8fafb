"""The effect that a model lacks. Usage: name_gap.py LOG URDF."""

import sys

import ident

log, urdf = sys.argv[1:]
gap = ident.find_gap(ident.Arm.from_urdf(urdf), ident.Recording.from_bag(log))
print(gap.verdict, *gap.sentences, sep="\n")
for effect in gap.effects:
    print(effect.name, effect.joints, effect.parameters)
gap.save("gap")
