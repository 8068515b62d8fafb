"""The catalogue of effects that a rigid-body model with Coulomb and viscous friction can miss."""
