"""What is known of an arm before it is measured: so little that it does not help, but every matrix has an inverse."""

import numpy as np

from core.geometry import Array
from core.planning.site import Site

TILT_RAD, SHIFT_M, TARGET_M = 0.1, 0.1, 1.0
WIDER = 10.0
"""Constants of functions: so many times what real drives have (``MotionForm.prior_std``)."""


def plausible_deviations(site: Site) -> Array:
    """How far each unknown may be from what is thought of it, (p,): a standard deviation with room to spare."""
    layout, state = site.layout, site.state
    out = np.full(layout.size, TARGET_M)
    for place in layout.axes:
        if place is not None:
            out[place] = [TILT_RAD, TILT_RAD, SHIFT_M, SHIFT_M][: place.stop - place.start]
    places = (*layout.transmissions, *layout.couplings)
    for place, function in zip(places, (*state.transmissions, *state.couplings), strict=True):
        if place is not None and function is not None:
            out[place] = WIDER * function.form.prior_std()
    return out


def vague(site: Site) -> Array:
    """The information of such deviations, (p, p)."""
    return np.diag(plausible_deviations(site) ** -2.0)
