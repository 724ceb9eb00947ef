"""A campaign that is planned and not measured yet: its points stand where they are expected."""

from dataclasses import replace

import numpy as np

from core.errors import CampaignError
from core.gap.doings import doings
from core.gap.library import candidates
from core.gap.observations import observe
from core.gap.placement import place
from core.gap.problem import Problem, pose_problem
from core.gap.whitening import whitening
from core.geometry import Array
from core.kinematics import link_frames, nominal_net
from core.measurements import Campaign


def with_expected_points(campaign: Campaign, base: Array) -> Campaign:
    """The same campaign with every sighted target where the nominal robot will have it.

    Args:
        campaign: targets need their likely places; an infinite ``sigma_m`` says: found from the points themselves.
        base: from the robot's base to the instrument's frame, roughly, (4, 4).

    Raises:
        CampaignError: a sighted target has no place on its link.
    """
    table, targets = campaign.measurements, campaign.targets
    sighted = np.flatnonzero(table.target >= 0)
    which = table.target[sighted]
    for t in np.unique(which):
        if targets[t].point_m is None:
            raise CampaignError(
                f"target {targets[t].name!r} has no place on its link, expected at least a rough one: nobody knows "
                "where it will be seen"
            )
    places = np.array([target.point_m or (np.nan,) * 3 for target in targets])[which]
    link = np.array([target.link for target in targets])[which]
    frames = base @ link_frames(campaign.robot, nominal_net(campaign.robot, table.commanded[sighted]))[:, :-1]
    # What stands on the floor is seen where it is.
    frame = np.where((link > 0)[:, None, None], frames[np.arange(len(link)), np.maximum(link, 1) - 1], np.eye(4))
    points = np.full((table.count, 3), np.nan)
    points[sighted] = (frame[:, :3, :3] @ places[:, :, None])[:, :, 0] + frame[:, :3, 3]
    return replace(campaign, measurements=replace(table, point_m=points))


def with_noise(campaign: Campaign, sigma_m: float | None, repeatability_m: float | None) -> Campaign:
    """The same campaign with the noise to expect of every point.

    Args:
        sigma_m: the instrument's, of one coordinate; None: as the campaign states.
        repeatability_m: the arm's, of one coordinate; None: none beside the instrument's noise.

    Raises:
        CampaignError: nothing is stated for some row, and nothing given.
    """
    table = campaign.measurements
    stated = np.isfinite(table.covariance_m2).all(axis=(1, 2)) & (sigma_m is None)
    sigma_m = campaign.instrument.sigma_m if sigma_m is None else sigma_m
    if sigma_m is None and (~stated & (table.target >= 0)).any():
        raise CampaignError(
            "the campaign does not state how exact its points will be, expected sigma_mm of the instrument or of rows"
        )
    covariance = np.where(stated[:, None, None], table.covariance_m2, (sigma_m or np.nan) ** 2 * np.eye(3))
    covariance = covariance + (repeatability_m or 0.0) ** 2 * np.eye(3)
    return replace(campaign, measurements=replace(table, covariance_m2=covariance))


def as_planned(campaign: Campaign) -> Campaign:
    """A campaign as if all of it were still to be measured, its points where they are expected.

    Where nothing was measured yet, the robot's base is the instrument's frame, and every target needs its likely place;
    else base and targets are where the measured points put them.

    Raises:
        CampaignError: a sighted target has no place on its link and was never measured.
    """
    if not campaign.measurements.seen.any():
        return with_expected_points(campaign, np.eye(4))
    seen = observe(campaign)
    sim = place(seen, np.where(seen.check, 0.0, 1.0) if not seen.check.all() else np.ones(seen.count))
    shown = set(seen.target)
    found = tuple(
        replace(target, point_m=tuple(sim.target_m[t].tolist()), sigma_m=target.sigma_m if target.point_m else np.inf)
        if t in shown
        else target
        for t, target in enumerate(campaign.targets)
    )
    return with_expected_points(replace(campaign, targets=found), sim.base)


def planned_problem(campaign: Campaign) -> Problem:
    """Columns of everything that a diagnosis of these points would look through; no residuals.

    Raises:
        CampaignError: no target on a moving link is sighted.
    """
    seen = observe(campaign)
    weight = (~seen.check).astype(float)
    sim = place(seen, weight / np.trace(seen.stated_covariance_m2, axis1=1, axis2=2))
    told = doings(seen)
    white = whitening(seen.stated_covariance_m2, weight)
    return pose_problem(sim, told, candidates(told), np.zeros((seen.count, 3)), white)


def untested(problem: Problem) -> tuple[str, ...]:
    """One sentence for every kind of effect that planned points cannot show at any size."""
    told = problem.doings
    seen, robot = told.seen, told.seen.campaign.robot
    out = []
    if not told.past.complete:
        out.append("Neither approach moves nor senses are planned: lost motion cannot be tested.")
    if told.loads is None:
        out.append("The robot does not say where gravity points: nothing that weights do can be tested.")
    elif not robot.links and not seen.payload_kg.any():
        out.append("The robot has no masses and no payload is planned: what weights do can hardly be tested.")
    elif np.ptp(seen.payload_kg) == 0:
        out.append("The payload is never changed: elastic effects and once-a-turn errors are hard to tell apart.")
    if told.speed is None and told.logged("readback") is None:
        out.append("Neither speeds nor read-back values are planned: latency cannot be tested.")
    if told.elapsed_s is None and told.logged("arm_temperature_c") is None and told.logged("temperature_c") is None:
        out.append("Neither times nor temperatures are planned: thermal growth cannot be tested.")
    still = [str(j + 1) for j in np.flatnonzero((seen.span < 1e-6) & seen.chain.commanded)]
    if still:
        out.append(f"Joints that never move: {', '.join(still)}: nothing can be said of their drives.")
    out.append("Steps of encoders are looked for in what was measured and not foretold.")
    return tuple(out)
