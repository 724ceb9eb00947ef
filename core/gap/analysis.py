"""The way from points to candidates: place, look, learn what the noise is, look again."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import count

import numpy as np

from core.gap import noise_found
from core.gap.design import Design
from core.gap.doings import Doings, doings
from core.gap.effects.candidate import Candidate
from core.gap.encoder_steps import encoder_steps
from core.gap.evidence import NOTHING, Chosen, Evidence, joined, without
from core.gap.folds import blocks
from core.gap.kept_out import KeptOut
from core.gap.library import candidates
from core.gap.observations import Observations
from core.gap.placement import place, placement_slots, with_placement
from core.gap.plainer import plainer
from core.gap.problem import KNOWN, Problem, pose_problem
from core.gap.scatter import joint_scatter
from core.gap.search import Found, search
from core.gap.sharpened import sharpened
from core.gap.sim import Sim
from core.gap.split import split
from core.gap.swings import swings
from core.gap.whitening import whitening
from core.geometry import Array

GEOMETRY_PRIORS = (3e-5, 1e-4)
"""How well a calibrated sim's geometry may be known, rad and m; the data choose."""
AS_CALIBRATED, UNCALIBRATED = 1e-4, 1e-3
"""Geometry known so well is what a calibration leaves; beyond, it is itself a cause."""
DRAWN_PRIORS = (UNCALIBRATED, 3e-3, 1e-2)
"""How far an arm as built may be from its drawing, rad and m; the data choose."""
STRAY = 2.5
"""Calibrated sizes rms by which geometry must stray before a sim is suspected to be as drawn."""
FAR_LEFT, GEOMETRY_CLOSES, GEOMETRY_STAYS = 2.0, 0.6, 0.9
"""That is said where causes alone leave so many times the floor, and geometry with causes at most such a part of what
they leave beyond it (mean squares); and stays so in later passes."""
STRAIGHTENED = 60
"""Likeliest candidates with which it is seen whether causes suffice that bend the sim."""
NULL_QUANTILE, NULL_MARGIN = 0.9, 5.0
"""Of the largest evidence that noise alone makes; beyond a quantile it falls off as exp(-x). What a calibration leaves
of geometry makes more than noise alone."""
MOST_FLEXIBLE, MOST_SPENT = 4, 0.08
"""Nameless functions that a flexible fit takes, none with more columns than such a share of the components."""
PASSES = 3
BENT = 0.15
"""Curvature below this share of the noise does not matter."""
NOTABLY = 0.002
"""Share of the log evidence below which better atoms are not worth another look."""
LEAST_FREEDOM = 12
"""Residuals that a fit leaves free; fewer say nothing of the noise."""
BEYOND_STATEMENT = 6.0
"""Times the stated variance: a statement may be off by a factor of two."""
ROW = 3
"""Points of one target off one after the other, which chance hardly ever makes outliers."""
FEW, NEARLY_ALL = 2, 0.7
"""Points that make such a share of all that a change explains are outliers, and no change."""
CHANCE, LEAST_EXCESS = 3.5, 0.2
"""Standard deviations, and logarithm of a ratio of variances, beyond which repeats scatter less than residuals."""

Progress = Callable[[float, str], None]


@dataclass(frozen=True, eq=False)
class NoiseFound:
    """What is used for noise."""

    covariance_m2: Array
    """That the search takes for noise, (m, 3, 3)."""
    floor_m2: Array
    """Mean square length that noise makes at each point, (m,)."""
    source: str
    stated: bool
    """Whether the campaign states any."""
    freedom: float
    tails: float
    memory: float
    excess: float
    """Variance that is left over the noise's when everything flexible has been fitted."""
    beyond_statement: float
    """Variance of the noise over the stated one's."""
    outliers: np.ndarray
    """Indices of points that are left out, (k,)."""
    weight: Array
    """(m,)"""
    scattering: int | None = None
    """The joint, 1..n, from which most of the scatter comes; None: from none more than from others."""

    @property
    def unlike_statement(self) -> bool:
        """Whether points scatter by far more than was stated of the instrument: something else does not repeat."""
        return self.beyond_statement > BEYOND_STATEMENT

    def over(self, seen: Observations, left_m: Array) -> "NoiseFound":
        """The same noise over more points, with what a fit leaves of them, (m, 3)."""
        stated = seen.stated_covariance_m2
        used, floor = (float(np.mean(part)) for part in (np.trace(self.covariance_m2, axis1=1, axis2=2), self.floor_m2))
        before = float(np.trace(stated, axis1=1, axis2=2).mean())
        covariance = _rescaled(stated, used / before)
        scaled = whitening(covariance, np.ones(seen.count)).rows(left_m)
        weight = seen.fitted.astype(float)
        # What a fit misses everywhere makes no outliers.
        scaled /= np.sqrt(max(noise_found.robust_variance(scaled[weight > 0]), 1.0))
        outlying = np.flatnonzero((weight > 0) & (np.abs(scaled).max(axis=1) > noise_found.OUTLYING))
        weight[outlying] = 0.0
        inlying = weight > 0
        weight[inlying] *= noise_found.student_weights(scaled[inlying], self.tails)
        floors = np.trace(_rescaled(stated, floor / before), axis1=1, axis2=2)
        return replace(self, covariance_m2=covariance, floor_m2=floors, outliers=outlying, weight=weight)


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """How well geometry is known, and what is found then."""

    evidence: Evidence
    geometry_prior: float
    """rad and m"""
    threshold: float
    """Log evidence that noise alone hardly ever makes."""
    found: Found
    given: Chosen = NOTHING
    """Geometry and zero offsets that are off by more than a calibration leaves, as the whole of the data says."""

    @property
    def everything(self) -> Chosen:
        return joined(self.given, self.found.chosen)

    @property
    def total(self) -> float:
        """Log evidence of everything together: placement, geometry, what is given and what was found."""
        return self.found.log_evidence + self.evidence.nuisance_evidence


@dataclass(frozen=True, eq=False)
class Analysis:
    """One campaign, searched."""

    sim: Sim
    doings: Doings
    problem: Problem
    best: Hypothesis
    noise: NoiseFound
    residual_m: Array
    """Real minus placed sim, (m, 3), about the placement that was fitted alone."""
    placed: Sim
    """That sim."""

    @property
    def evidence(self) -> Evidence:
        return self.best.evidence

    @property
    def geometry_prior(self) -> float:
        return self.best.geometry_prior

    @property
    def threshold(self) -> float:
        return self.best.threshold

    @property
    def found(self) -> Found:
        return self.best.found

    @property
    def given(self) -> Chosen:
        return self.best.given

    @property
    def everything(self) -> Chosen:
        return self.best.everything


def analyse(
    seen: Observations,
    without: frozenset[str] = frozenset(),
    told: Callable[[Candidate], bool] | None = None,
    progress: Progress = lambda share, what: None,
) -> Analysis:
    """Search the candidates for the causes of the gap.

    Args:
        without: effects that the library shall not know.
        told: which named candidates are looked at; None: all.
    """
    base_weight = seen.fitted.astype(float)
    progress(0.02, "placing base and targets")
    covariance = seen.stated_covariance_m2
    sim = placed = place(seen, base_weight / np.trace(covariance, axis1=1, axis2=2))
    residual_m = seen.point_m - sim.points_m()
    told_doings = doings(seen)
    library = candidates(told_doings, without)
    if told is not None:
        library = [one for one in library if not one.named or told(one)]
    progress(0.1, "estimating the noise")
    first = noise = _first_noise(told_doings, residual_m, covariance, base_weight)
    aim, drawn = residual_m, False
    for turn in count():
        progress((turn + 0.5) / (PASSES + 1), "searching for causes")
        white = whitening(noise.covariance_m2, noise.weight, noise.memory)
        problem = pose_problem(sim, told_doings, library, aim, white)
        floor_m2 = float(noise.floor_m2.mean())
        best = _best_prior(problem, floor_m2, GEOMETRY_STAYS if drawn else GEOMETRY_CLOSES)
        drawn = bool(best.given.groups)
        learnt = _learn(told_doings, problem, best, first, told, steps=turn == 0)
        fresh = [one for one in learnt.sharper if one.place.effect not in without]
        straight = learnt.bent_m2 < BENT**2 * noise.floor_m2.mean()
        better = bool(fresh) if turn == 0 else _matter(fresh, problem, best)
        settled = _settled(noise, learnt.noise) and straight and not better
        if settled or turn == PASSES - 1:
            best = replace(best, found=_as_named(problem, best))
            return Analysis(sim, told_doings, problem, best, noise, residual_m, placed)
        noise, library = learnt.noise, [*library, *fresh]
        if not straight:
            sim, aim = learnt.sim, learnt.residual_m
        # The largest things in memory are not held twice.
        del problem, best


def _as_named(problem: Problem, best: Hypothesis) -> Found:
    """What was found, without names that only stand in for others."""
    known = best.threshold, best.given
    return plainer(problem, best.evidence, split(problem, best.evidence, best.found, *known), *known)


@dataclass(frozen=True, eq=False)
class Learnt:
    """What one pass teaches the next."""

    noise: NoiseFound
    sharper: list[Candidate]
    sim: Sim
    """Placed where the strongest cause lets it stand."""
    residual_m: Array
    """Real minus that sim, as if the model were linear about the fitted state, (m, 3)."""
    bent_m2: float
    """Mean square of what linear columns miss."""


def _settled(before: NoiseFound, after: NoiseFound) -> bool:
    ratio = (
        np.trace(after.covariance_m2, axis1=1, axis2=2).mean() / np.trace(before.covariance_m2, axis1=1, axis2=2).mean()
    )
    same = abs(ratio - 1) < 0.15 and abs(after.memory - before.memory) < 0.1
    same &= after.scattering == before.scattering
    return bool(same and np.abs(after.weight - before.weight).mean() < 0.003)


def _matter(fresh: list[Candidate], problem: Problem, best: Hypothesis) -> bool:
    """Whether fresh candidates beside or instead of what was found say notably more."""
    known = {(one.place, one.atom) for one in problem.candidates}
    fresh = [one for one in fresh if (one.place, one.atom) not in known]
    if not fresh:
        return False
    old, given, prior = best.everything, best.given, best.geometry_prior
    few = pose_problem(
        problem.sim,
        problem.doings,
        [*(problem.candidates[g] for g in old.groups), *fresh],
        problem.residual_m,
        problem.white,
    )
    there = Chosen(tuple(range(len(given.groups))), given.sizes)
    again = search(
        few.evidence(prior), np.arange(len(given.groups), len(few.candidates)), few.cost, best.threshold, there
    )
    before = few.evidence(prior).given(Chosen(tuple(range(len(old.groups))), old.sizes))
    before -= float(few.cost[len(given.groups) : len(old.groups)].sum())
    return again.log_evidence > before + best.threshold + NOTABLY * max(before, 0.0)


def _first_noise(told: Doings, residual_m: Array, covariance: Array, weight: Array) -> NoiseFound:
    """The stated noise, corrected by repeats if there are any."""
    root = np.linalg.inv(np.linalg.cholesky(covariance))
    whitened = np.einsum("mij,mj->mi", root, residual_m)
    found = noise_found.repeats(told, whitened, weight > 0, near=True)
    stated = bool(told.seen.campaign.instrument.sigma_m) or bool(
        np.isfinite(told.seen.campaign.measurements.covariance_m2[told.seen.rows]).all()
    )
    source = "statement" if stated else "residuals"
    freedom, beyond = 0.0, 1.0
    if found is not None:
        covariance, source, freedom = _rescaled(covariance, found.variance), "replicates", found.freedom
        beyond = found.variance if stated else 1.0
    elif told.seen.calibrated is not None:
        covariance = _as_calibrated_with(told.seen.calibrated.noise_m, covariance)
    floor = np.trace(covariance, axis1=1, axis2=2)
    none = np.zeros(0, dtype=int)
    return NoiseFound(covariance, floor, source, stated, freedom, np.inf, 0.0, 1.0, beyond, none, weight)


def _as_calibrated_with(noise_m: float, covariance: Array) -> Array:
    """Stated covariances, or what a calibration found beside the statement: how well the arm comes back to a place."""
    stated_m2 = np.trace(covariance, axis1=1, axis2=2).mean() / 3
    more = np.isfinite(noise_m) and noise_m**2 > stated_m2
    return _rescaled(covariance, noise_m**2 / stated_m2) if more else covariance


def _rescaled(covariance: Array, variance: float) -> Array:
    """Stated covariances with the variance that was found: more is added evenly, less shrinks them."""
    if variance <= 1:
        return covariance * max(variance, 1e-12)
    extra = (variance - 1) * np.trace(covariance, axis1=1, axis2=2).mean() / 3
    return covariance + extra * np.eye(3)


def _best_prior(problem: Problem, floor_m2: float, closes: float) -> Hypothesis:
    """The geometry prior under which everything together is most probable, and what is found with it.

    Args:
        closes: part of what causes alone leave beyond the floor that geometry with causes may leave, to be drawn.
    """
    calibrated = _as_calibrated(problem)
    if not _geometry_strays(problem):
        return calibrated
    left = _kept_out_m2(problem, calibrated, KNOWN)
    if left > FAR_LEFT * floor_m2:
        left = min(left, _straightened_m2(problem, calibrated, floor_m2))
    if left <= FAR_LEFT * floor_m2:
        return calibrated
    # As drawn: data enough overcome any prior, and what is fitted along must not hide what is off.
    drawn = _as_drawn(problem)
    if drawn.total < calibrated.total:
        return calibrated
    beyond = _kept_out_m2(problem, drawn, AS_CALIBRATED) - floor_m2
    return drawn if beyond < closes * (left - floor_m2) else calibrated


def _as_calibrated(problem: Problem) -> Hypothesis:
    """The prior under which everything together is most probable, and what is found with it."""
    tight, loose = (problem.evidence(prior) for prior in GEOMETRY_PRIORS)
    threshold = null_threshold(problem, tight)
    found = search(tight, problem.named, problem.cost, threshold)
    best = Hypothesis(tight, GEOMETRY_PRIORS[0], threshold, found)
    # A looser one may take up what has a name, and is looked at where it says more of what the tight one found.
    if loose.given(found.chosen) + loose.nuisance_evidence > tight.given(found.chosen) + tight.nuisance_evidence:
        again = search(loose, problem.named, problem.cost, threshold)
        best = max(best, Hypothesis(loose, GEOMETRY_PRIORS[1], threshold, again), key=lambda one: one.total)
    return best


def _geometry_strays(problem: Problem) -> bool:
    """Whether geometry alone would have to stray far beyond what a calibration leaves."""
    evidence = problem.evidence(UNCALIBRATED)
    _, estimate = numbers(problem, evidence, UNCALIBRATED, Chosen())
    strays = estimate[problem.placement : problem.nuisance - problem.doubt] / AS_CALIBRATED
    return bool(np.sum(strays**2) > STRAY**2 * len(strays))


def _kept_out_m2(problem: Problem, one: Hypothesis, prior: float) -> float:
    """The least that a hypothesis leaves of kept-out points where geometry beside it is known to so much, m^2.

    With all that was found, or less: small causes may overfit, and may also be what keeps geometry from straying.
    """
    names, given = one.found, one.given
    kept = KeptOut(problem, blocks(problem.sim.seen), prior, joined(given, names.chosen, names.worth).groups)
    return min(kept.square_m2(joined(given, some)) for some in (names.chosen, names.worth))


def _straightened_m2(problem: Problem, one: Hypothesis, floor_m2: float) -> float:
    """What causes leave of kept-out points once the sim is placed anew about the strongest, m^2; infinite: it stands.

    What a large cause bends, free geometry takes up, and seems to be needed for it.
    """
    found = one.found
    state = Chosen(found.chosen.groups[:1], found.chosen.sizes[:1])
    if not state.groups:
        return np.inf
    sim, aim_m, bent_m2 = _about_fit(problem, one.evidence, one.geometry_prior, state, one.given)
    if bent_m2 < BENT**2 * floor_m2:
        return np.inf
    likely = problem.named[np.argsort(-found.alone[problem.named])[:STRAIGHTENED]]
    groups = list(dict.fromkeys((*found.chosen.groups, *(int(g) for g in likely))))
    few = pose_problem(sim, problem.doings, [problem.candidates[g] for g in groups], aim_m, problem.white)
    again = search(few.evidence(one.geometry_prior), few.named, few.cost, one.threshold)
    kept = KeptOut(few, blocks(problem.sim.seen), KNOWN, again.chosen.groups)
    return kept.square_m2(again.chosen)


def null_threshold(problem: Problem, evidence: Evidence) -> float:
    """Log evidence that noise alone hardly ever makes of any candidate."""
    return float(np.quantile(evidence.null_maxima(problem.cost), NULL_QUANTILE) + NULL_MARGIN)


def _as_drawn(problem: Problem) -> Hypothesis:
    """The search when the sim's geometry is a drawing's, off by what makes everything together most probable."""
    evidence = problem.evidence(AS_CALIBRATED)
    threshold = null_threshold(problem, evidence)
    # The sim's geometry is generally off: every frame and zero offset is a cause from the start.
    sizes = {size: drawn_geometry(problem, size) for size in DRAWN_PRIORS}
    first = DRAWN_PRIORS[len(DRAWN_PRIORS) // 2]
    found = search(evidence, problem.named, problem.cost, threshold, sizes[first])
    best = max(sizes, key=lambda size: evidence.given(joined(sizes[size], found.chosen)))
    given = sizes[first]
    if best != first:
        again = search(evidence, problem.named, problem.cost, threshold, sizes[best])
        if again.log_evidence > found.log_evidence:
            found, given = again, sizes[best]
    return Hypothesis(evidence, AS_CALIBRATED, threshold, found, given)


def drawn_geometry(problem: Problem, size: float = UNCALIBRATED) -> Chosen:
    """Every frame and zero offset, each with the scale (rad, m) that a drawing may be off by."""
    members = [int(k) for k in problem.named if _of_geometry(problem.candidates[k])]
    return Chosen(tuple(members), tuple(size / float(problem.design.scale[problem.slices[k].start]) for k in members))


def _of_geometry(candidate: Candidate) -> bool:
    return candidate.place.effect == "geometry" or (candidate.place.effect == "zero_offset" and not candidate.atom)


def _learn(
    told: Doings,
    problem: Problem,
    best: Hypothesis,
    first: NoiseFound,
    only: Callable[[Candidate], bool] | None,
    steps: bool,
) -> Learnt:
    """What a flexible fit says of the noise, sharper atoms, and residuals about the fitted state.

    Args:
        steps: whether steps of encoders and swings of the base are looked for.
    """
    evidence, prior, found = best.evidence, best.geometry_prior, best.found
    given, everything = best.given, best.everything
    named_left, own = _left(problem, evidence, prior, everything)
    flexible = _flexible(problem, evidence, everything, best.threshold)
    left, _ = _left(problem, evidence, prior, flexible)
    noise = _learned_noise(told, problem, _spent(problem, evidence, prior, flexible), left, first)
    scale = 3 * noise.weight / np.trace(noise.covariance_m2, axis1=1, axis2=2)
    chosen = [problem.candidates[g] for g in everything.groups]
    better = sharpened(problem.sim, told, chosen, named_left, own, scale)
    noise = _undoubted(noise, first, told.seen, chosen, better)
    moments = [g for g in found.chosen.groups if problem.candidates[g].place.record is not None]
    if moments:
        unchanged, _ = _left(problem, evidence, prior, without(everything, moments))
        noise = _doubted(noise, _spoken_for_by_few(told.seen, unchanged, named_left, noise))
    if steps or (noise.excess > 1 and not given.groups):
        aims = [named_left]
        if steps and found.chosen.groups:
            bare, _ = _left(problem, evidence, prior, given)
            # Where all geometry is free, what names took up is no better known than what they left.
            aims = [bare] if given.groups else [named_left, bare]
        better += encoder_steps(problem.sim, told, aims, scale)
    if steps:
        better += swings(problem.sim, _left(problem, evidence, prior, given)[0], scale)
    if only is not None:
        better = [one for one in better if not one.named or only(one)]
    state = joined(given, Chosen(found.chosen.groups[:1], found.chosen.sizes[:1]))
    return Learnt(noise, better, *_about_fit(problem, evidence, prior, state, given))


def _flexible(problem: Problem, evidence: Evidence, chosen: Chosen, threshold: float) -> Chosen:
    widths = np.array([problem.slices[g].stop - problem.slices[g].start for g in problem.nameless])
    for _ in range(MOST_FLEXIBLE):
        gains = evidence.gains(problem.nameless, chosen)
        taken = np.isin(problem.nameless, chosen.groups) | (widths > problem.sums.count * MOST_SPENT)
        score = np.where(taken, -np.inf, gains.evidence)
        best = int(np.argmax(score))
        if not score[best] > threshold:
            break
        chosen = chosen.plus(int(problem.nameless[best]), float(gains.size[best]))
    return chosen


def _spent(problem: Problem, evidence: Evidence, prior: float, chosen: Chosen) -> float:
    """Degrees of freedom that a fit takes: the trace of its hat matrix."""
    index = np.concatenate([np.arange(problem.nuisance), evidence.index(chosen.groups)]).astype(int)
    precision = np.concatenate([problem.nuisance_precision(prior), evidence.prior(chosen)])
    square = problem.sums.square.within(index)
    return float(np.trace(np.linalg.solve(square + np.diag(precision), square)))


def numbers(problem: Problem, evidence: Evidence, prior: float, chosen: Chosen) -> tuple[np.ndarray, Array]:
    """Columns of placement, geometry and chosen candidates, and their estimates from all points."""
    index = np.concatenate([np.arange(problem.nuisance), evidence.index(chosen.groups)]).astype(int)
    precision = np.concatenate([problem.nuisance_precision(prior), evidence.prior(chosen)])
    square = problem.sums.square.within(index) + np.diag(precision)
    return index, np.linalg.solve(square, problem.sums.pull[index])


def _left(problem: Problem, evidence: Evidence, prior: float, chosen: Chosen) -> tuple[Array, list[Array]]:
    """Residuals after a fit of all points, and what each chosen candidate moves, (m, 3) each."""
    index, estimate = numbers(problem, evidence, prior, chosen)
    plain = problem.design.some(index).whole()
    own, at = [], problem.nuisance
    for g in chosen.groups:
        width = problem.slices[g].stop - problem.slices[g].start
        own.append(plain[:, :, at : at + width] @ estimate[at : at + width])
        at += width
    return problem.residual_m - plain @ estimate, own


def _about_fit(
    problem: Problem, evidence: Evidence, prior: float, chosen: Chosen, given: Chosen
) -> tuple[Sim, Array, float]:
    """The sim placed anew, and residuals as if the model were linear about the fitted state: exact there.

    The strongest candidate alone sets the state: weaker ones may be there only because the model was bent.
    """
    sim = problem.sim
    if sim.seen.simulated_m is not None or given.groups:
        # Where all geometry is free it trades with the base: the fitted state may lie far from where the points are.
        return sim, problem.residual_m, 0.0
    index, estimate = numbers(problem, evidence, prior, chosen)
    slots = placement_slots(sim.seen)
    anew = with_placement(sim, slots, estimate[: len(slots)])
    rest = Design(anew, problem.design.some(index[len(slots) :]).columns, problem.design.scale[index[len(slots) :]])
    left = estimate[len(slots) :]
    bent = anew.moved_m(rest.motions(left)) - anew.points_m() - rest.whole() @ left
    old = problem.design.some(index)
    missed = anew.moved_m(rest.motions(left)) - sim.points_m() - old.whole() @ estimate
    missed -= sim.seen.point_m - sim.points_m() - problem.residual_m
    return anew, sim.seen.point_m - anew.points_m() - bent, float(np.mean(np.sum(missed**2, axis=1)))


def _learned_noise(told: Doings, problem: Problem, spent: float, left: Array, first: NoiseFound) -> NoiseFound:
    """Scale, tails, memory and outliers of what a flexible fit leaves, beside the scatter of repeats."""
    covariance = first.covariance_m2
    standard = whitening(covariance, np.ones(len(left))).rows(left)
    used = first.weight > 0
    freedom = 3 * np.count_nonzero(used) - spent
    if freedom < LEAST_FREEDOM:
        return first
    variance = noise_found.robust_variance(standard[used]) * 3 * np.count_nonzero(used) / freedom
    covariance = _rescaled(covariance, variance)
    weight = first.weight.copy()
    weight[_outlying(told.seen, left, covariance, used)] = 0.0
    scatter = joint_scatter(problem.sim, told, left, whitening(covariance, (weight > 0).astype(float)))
    shaped = covariance if scatter is None else scatter.over(covariance)
    scaled = whitening(shaped, np.ones(len(left))).rows(left)
    memory = noise_found.memory(told, scaled, used)
    outlying = _outlying(told.seen, left, shaped, used)
    weight = first.weight.copy()
    weight[outlying] = 0.0
    inlying = weight > 0
    tails = noise_found.tail_degrees(scaled[inlying])
    weight[inlying] *= noise_found.student_weights(scaled[inlying], tails)
    floor, source, excess = np.trace(covariance, axis1=1, axis2=2), "residuals", 1.0
    if first.stated and first.source != "replicates":
        # Nothing says that what is left beyond a stated noise is noise.
        floor = first.floor_m2
    again = noise_found.repeats(told, standard, inlying, near=False)
    if again is not None:
        repeated = again.variance / max(1.0 - memory**again.lag, 0.05)
        source, excess = "replicates", variance / max(repeated, 1e-300)
        spread = np.sqrt(2 / again.freedom + 2 / freedom)
        # What repeats soon after each other tell of noise with a memory hangs on the memory, which is estimated too.
        if np.log(excess) > max(CHANCE * spread, LEAST_EXCESS * (1 + memory)):
            floor = np.trace(_rescaled(first.covariance_m2, repeated), axis1=1, axis2=2)
        else:
            excess, freedom = 1.0, freedom + again.freedom
    beyond = first.beyond_statement * variance / excess if first.stated else 1.0
    joint = None if scatter is None else scatter.joint
    return NoiseFound(
        shaped, floor, source, first.stated, freedom, tails, memory, excess, beyond, outlying, weight, joint
    )


def _undoubted(
    noise: NoiseFound, first: NoiseFound, seen: Observations, chosen: list[Candidate], better: list[Candidate]
) -> NoiseFound:
    """Points between a moment and the better one count again: they were off because of the wrong moment."""
    between = np.zeros(seen.count, dtype=bool)
    for new in better:
        for old in chosen:
            if new.place.record is not None and old.place.record is not None and new.place.same_as(old.place):
                low, high = sorted((new.place.record, old.place.record))
                between |= (seen.record >= low) & (seen.record <= high)
    outliers = noise.outliers[~between[noise.outliers]]
    return replace(noise, weight=np.where(between, first.weight, noise.weight), outliers=outliers)


def _spoken_for_by_few(seen: Observations, before_m: Array, after_m: Array, noise: NoiseFound) -> np.ndarray:
    """Indices of the one or two points for whose sake moments of change were found, (k,).

    Args:
        before_m: residuals without the changes, (m, 3).
        after_m: with them, (m, 3).
    """
    white = whitening(noise.covariance_m2, np.ones(seen.count))
    before, after = (np.sum(white.rows(part) ** 2, axis=1) * seen.fitted for part in (before_m, after_m))
    smaller = before - after
    most = np.argsort(-smaller)[:FEW]
    few = most[before[most] > noise_found.OUTLYING**2]
    return few if smaller[few].sum() > NEARLY_ALL * max(float(smaller.sum()), 1e-300) else few[:0]


def _doubted(noise: NoiseFound, points: np.ndarray) -> NoiseFound:
    weight = noise.weight.copy()
    weight[points] = 0.0
    return replace(noise, weight=weight, outliers=np.union1d(noise.outliers, points))


def _outlying(seen: Observations, left_m: Array, covariance_m2: Array, used: np.ndarray) -> np.ndarray:
    """Indices of points that are farther off than any noise, (k,).

    Outliers come alone: many in a row of one target are something that no candidate describes yet.
    """
    scaled = whitening(covariance_m2, np.ones(len(left_m))).rows(left_m)
    off = used & (np.abs(scaled).max(axis=1) > noise_found.OUTLYING)
    for target in np.unique(seen.target):
        rows = np.flatnonzero(used & (seen.target == target))
        off[rows] &= ~_in_a_row(off[rows], ROW)
    return np.flatnonzero(off)


def _in_a_row(marked: np.ndarray, count: int) -> np.ndarray:
    """Those marked that stand in a row of at least so many."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], marked, [False]]).astype(int)))
    out = np.zeros(len(marked), dtype=bool)
    for first, end in zip(edges[::2], edges[1::2], strict=True):
        out[first:end] = end - first >= count
    return out
