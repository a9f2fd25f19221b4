"""Surfaces as they are after an edit, as whole displacements of surveyed ones."""

from mracad.inspect.ramp import Ramp


def changes(surveyed, nets):
    """The changes of surveyed surfaces to nets over the same knots, with the same weights."""
    whole = Ramp(surveyed, [net.poles - survey.net.poles for survey, net in zip(surveyed, nets, strict=True)])
    return list(whole.changes(dict.fromkeys(range(len(nets)), 1.0)).values())
