"""Encoded trajectories with something about them changed."""

import dataclasses


def altered(encoded, leg=0, **changes):
    """The trajectory with fields of one leg replaced."""
    legs = list(encoded.legs)
    legs[leg] = dataclasses.replace(legs[leg], **changes)
    return dataclasses.replace(encoded, legs=tuple(legs))
