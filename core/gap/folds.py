"""Which points are kept out of a fit together: pieces of arcs and regions of the joint space, never single points."""

import warnings

import numpy as np
from scipy.cluster.vq import kmeans2

from core.gap.observations import Observations
from core.geometry import Array

FOLDS = 5
REGIONS = 25
SEED = 5
CHECK = FOLDS
"""Fold of the owner's validation rows: no fit sees them."""


def blocks(seen: Observations) -> np.ndarray:
    """Fold of every point: fifths of each arc, regions of poses, (m,)."""
    fold = np.zeros(seen.count, dtype=int)
    sweep = seen.campaign.measurements.sweep[seen.rows]
    for joint, number in {(int(j), int(s)) for j, s in zip(seen.joint[seen.swept], sweep[seen.swept], strict=True)}:
        rows = np.flatnonzero(seen.swept & (seen.joint == joint) & (sweep == number))
        place = seen.active[rows, joint - 1]
        share = (place - place.min()) / max(np.ptp(place), 1e-12)
        fold[rows] = np.minimum((share * FOLDS).astype(int), FOLDS - 1)
    posed = np.flatnonzero(~seen.swept)
    if len(posed):
        fold[posed] = regions(seen.active[posed], seen.span) % FOLDS
    return fold if seen.check.all() else np.where(seen.check, CHECK, fold)


def placeable(seen: Observations, fold: np.ndarray, used: np.ndarray) -> np.ndarray:
    """Points whose target's place is known, or shown by some point that is used in another fold, (m,)."""
    out = np.ones(seen.count, dtype=bool)
    if seen.simulated_m is not None:
        return out
    fitted = used & (fold != CHECK)
    for target in np.unique(seen.target):
        if seen.campaign.targets[target].point_m is None:
            mine = seen.target == target
            for f in np.unique(fold[mine]):
                out[mine & (fold == f)] = (mine & fitted & (fold != f)).any()
    return out


def regions(active: Array, span: Array, count: int = REGIONS) -> np.ndarray:
    """Region of the joint space that each configuration lies in, by k-means on joints scaled to their spans."""
    scaled = active / np.maximum(span, 1e-9)
    places, which = np.unique(np.round(scaled, 9), axis=0, return_inverse=True)
    count = min(count, max(FOLDS, len(places) // 3))
    if len(places) <= count:
        return which.ravel()
    with warnings.catch_warnings():
        # A region that stays empty does no harm.
        warnings.simplefilter("ignore", UserWarning)
        _, label = kmeans2(places, count, minit="++", seed=SEED)
    return label[which.ravel()]


def times(seen: Observations) -> np.ndarray:
    """Fold of every point: fifths of the time, (m,)."""
    return np.where(seen.check, CHECK, np.minimum((seen.time * FOLDS).astype(int), FOLDS - 1))
