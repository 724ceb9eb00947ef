"""A proposal as the campaign that it will be: points where they are expected, with the noise that they will have."""

from dataclasses import replace

import numpy as np

from core.measurements import Campaign
from core.planning.information import expected_covariance
from core.planning.proposal import Proposal


def planned_campaign(proposal: Proposal, seconds_a_shot: float, places_known: bool) -> Campaign:
    """The rows of a proposal with expected points, their covariances, and the times at which they will be taken.

    Args:
        places_known: whether places of targets that are given are those on the real links; else they are examples.
    """
    site, rows = proposal.site, proposal.rows
    sighted = np.flatnonzero(rows.target >= 0)
    points = np.full((rows.count, 3), np.nan)
    covariance = np.full((rows.count, 3, 3), np.nan)
    seen = site.predict(rows.commanded[sighted], rows.target[sighted])
    points[sighted], covariance[sighted] = seen.point_m, expected_covariance(site, seen)
    time_s = seconds_a_shot * np.cumsum(rows.target >= 0)
    table = replace(rows, point_m=points, covariance_m2=covariance, time_s=time_s.astype(float))
    targets = site.targets if places_known else tuple(replace(one, point_m=None) for one in site.targets)
    return Campaign(site.robot, targets, table, home=site.home)
