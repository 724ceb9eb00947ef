"""The whole way from a campaign to what is said of its gap."""

import resource
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from core.calibrated_arm import CalibratedArm
from core.errors import CampaignError
from core.gap.advice import advice
from core.gap.analysis import NULL_MARGIN, NULL_QUANTILE, Analysis, Progress, analyse
from core.gap.corrected import CorrectedSim, Diagnosis
from core.gap.detection import detection_limits
from core.gap.effects.candidate import Candidate
from core.gap.evidence import Chosen, joined, without
from core.gap.folds import blocks
from core.gap.kept_out import KeptOut, mean_square
from core.gap.observations import Observations, observe
from core.gap.open_set import AT_FLOOR, Judge, Stand, chosen_of
from core.gap.placement import placement_slots
from core.gap.posterior import AT_BEST, BESIDE_UNKNOWN, adequate, floats, rivals, twins
from core.gap.problem import Problem
from core.gap.reliability import reliability
from core.gap.result import (
    NEAR_FLOOR,
    Cause,
    Cell,
    LeftTest,
    NoiseModel,
    Outlier,
    Parameter,
    Place,
    Rivals,
    Verdict,
)
from core.gap.said import Said, told_stands
from core.gap.transfer import transfers
from core.gap.warnings_of import warnings_of
from core.gap.where import where
from core.gap.widened import Wide, thinned, widened
from core.geometry import Array
from core.measurements import Campaign

UNKNOWN_FIRST, UNKNOWN_BESIDE = 0.9, 0.35
"""That something without a name acts at that joint or variable, where it is the strongest that is told, and where it
is told beside others; as often as it was so in simulated worlds."""
HOLD_OUT = "fifths of each arc and regions of the joint space, each predicted from the others"
CLOSED = 0.9
"""Share of the gap beyond the floor that causes must close to explain it."""
ALL_NEEDED = 0.7
"""What all that was found leaves of kept-out points over what fewer names leave, where the small ones are real."""
NEARLY = 1.6
"""Floors that may be left at most where causes explain a gap."""
BEYOND_NOISE = 2.0
"""Times what noise lets expect: where kept-out points are farther off, there is a gap, whatever the search says."""
NOISE_LIKE = 0.01
"""Probability below which what is left is not noise."""


def quiet(share: float, what: str) -> None:
    """Progress that nobody watches."""


def diagnose(
    campaign: Campaign,
    arm: CalibratedArm | None = None,
    told: Sequence[dict[str, object]] | None = None,
    without: Sequence[str] = (),
    progress: Progress = quiet,
) -> Diagnosis:
    """Where real and sim part, which effects cause it, how far the gap shrinks on points kept out of every fit.

    Args:
        arm: a calibrated arm as the sim; None: the campaign's nominal robot, or the simulated points in it.
        told: the causes, as answers name them: nothing else is searched; None: nobody knows.
        without: effects that the library shall not know.
        progress: called with a share of the work and what is being done.

    Raises:
        CampaignError: there is nothing to compare, or too little.
    """
    start = time.perf_counter()
    seen = observe(campaign, arm)
    _require_enough(seen)
    only = None if told is None else _only(told)
    some = thinned(seen)
    analysis = analyse(some, frozenset(without), only, progress or quiet)
    (progress or quiet)(0.85, "judging causes on kept-out points")
    found = Findings(analysis, seen, blocks(some), told is not None)
    report = _report(campaign, arm, found)
    (progress or quiet)(1.0, "done")
    return replace(
        report,
        seconds=time.perf_counter() - start,
        peak_memory_mb=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    )


def _require_enough(seen: Observations) -> None:
    """Whether anything is left to compare once base and targets are placed."""
    unknowns, points = len(placement_slots(seen)), int(np.count_nonzero(~seen.check)) or seen.count
    if 3 * points <= unknowns:
        raise CampaignError(
            f"{points} measured {'point' if points == 1 else 'points'} cannot be compared with a sim: where the base "
            f"and the targets stand takes {unknowns} numbers, so at least {unknowns // 3 + 1} points are needed"
        )


def _only(told: Sequence[dict[str, object]]) -> Callable[[Candidate], bool]:
    def wanted(candidate: Candidate) -> bool:
        return any(_is(candidate.place, answer) for answer in told)

    return wanted


def _is(place: Place, answer: dict[str, object]) -> bool:
    keys = {"joint": place.joint, "link": place.joint, "frame": place.frame, "target": place.target}
    keys |= {"from": place.source, "to": place.joint}
    return place.effect == answer.get("effect") and all(
        keys[key] == value for key, value in answer.items() if key in keys and value is not None
    )


@dataclass(frozen=True, eq=False)
class Findings:
    """What stands, and how well it predicts points that no fit has seen."""

    analysis: Analysis
    seen: Observations
    """All points; the analysis may have searched some of them."""
    fold: np.ndarray
    """Of the searched points."""
    told: bool

    @cached_property
    def judge(self) -> Judge:
        a = self.analysis
        return Judge(
            a.problem,
            a.evidence,
            self.fold,
            a.geometry_prior,
            a.threshold,
            self.floor_m2,
            a.found.chosen,
            self.worth,
            a.given,
            a.noise.excess,
        )

    @cached_property
    def worth(self) -> Chosen:
        """What is to be judged: the main ones of many where all are needed and leave noise, else few that could do."""
        a, found = self.analysis, self.analysis.found
        if found.worth == found.main:
            return found.main
        all_of_them = joined(a.given, found.chosen, found.worth)
        kept = KeptOut(a.problem, self.fold, a.geometry_prior, all_of_them.groups)
        with_all, with_few = (kept.square_m2(joined(a.given, some)) for some in (found.chosen, found.worth))
        return found.main if with_all < min(ALL_NEEDED * with_few, AT_FLOOR * self.floor_m2) else found.worth

    @cached_property
    def floor_m2(self) -> float:
        return float(np.mean(self.analysis.noise.floor_m2))

    @cached_property
    def stands(self) -> list[Stand]:
        """Named causes, the one that the data say most for first, and unknown ones."""
        return told_stands(self.analysis) if self.told else Said(self.analysis, self.judge).stands()

    @cached_property
    def named(self) -> list[Stand]:
        return [one for one in self.stands if not one.unknown]

    @cached_property
    def chosen(self) -> Chosen:
        """All named causes."""
        return joined(chosen_of(self.named), self.analysis.given)

    @cached_property
    def wide(self) -> Wide:
        """All points with every candidate that stands or describes what does not."""
        groups = joined(self.chosen, chosen_of(self.stands)).groups
        return widened(self.analysis, self.seen, groups, self.chosen)

    @cached_property
    def all_folds(self) -> np.ndarray:
        return self.fold if self.seen is self.analysis.sim.seen else blocks(self.seen)

    @cached_property
    def kept(self) -> KeptOut:
        """Models of causes with the small changes of geometry as they are: what each cause closes."""
        return self._kept(chosen_of(self.stands), self.judge.geometry)

    @cached_property
    def honest(self) -> KeptOut:
        """All named causes, with geometry found anew by every fit or left alone: how good the corrected sim is."""
        anew, alone = (self._kept(self.chosen, geometry) for geometry in (None, np.zeros(self.wide.problem.geometry)))
        chosen = self.wide.chosen(self.chosen)
        return anew if anew.square_m2(chosen) < alone.square_m2(chosen) else alone

    def _kept(self, chosen: Chosen, geometry: Array | None) -> KeptOut:
        groups = self.wide.chosen(joined(self.chosen, chosen)).groups
        return KeptOut(self.wide.problem, self.all_folds, self.analysis.geometry_prior, groups, geometry)

    def square_m2(self, chosen: Chosen) -> float:
        """Mean square of what causes leave of kept-out points, m^2."""
        return self.kept.square_m2(self.wide.chosen(chosen))

    @cached_property
    def gap_m2(self) -> float:
        """With base and targets placed alone."""
        return mean_square(self._placed_left()[self.kept.judged])

    @cached_property
    def left_m2(self) -> float:
        """With all named causes."""
        return self.honest.square_m2(self.wide.chosen(self.chosen))

    @property
    def within_calibration_m(self) -> float:
        """What is left, rms, where a calibrated sim moves within its own uncertainty alone; NaN: it states none."""
        if not self.wide.problem.doubt:
            return np.nan
        return float(np.sqrt(self.square_m2(Chosen()) if self.stands else self.left_m2))

    @cached_property
    def expected_m2(self) -> float:
        """What noise lets expect to be left on kept-out points, fits as uncertain as they are."""
        noise_m2 = np.trace(self.wide.noise.covariance_m2, axis1=1, axis2=2)
        return self.honest.expected_m2(self.wide.chosen(self.chosen), noise_m2)

    @cached_property
    def left_m(self) -> Array:
        """Residuals after all named causes, fitted on all points, (m, 3)."""
        index, numbers, _ = self.honest.fitted(self.wide.chosen(self.chosen))
        return self.wide.problem.residual_m - self.honest.plain[:, :, index] @ numbers

    def _placed_left(self) -> Array:
        """Residuals with base and targets alone, about their own placement, each fold from the others, (m, 3)."""
        placed, noise = replace(self.analysis.placed, seen=self.seen), self.wide.noise
        slots = placement_slots(self.seen)
        residual_m = self.wide.residual_m
        if not slots:
            return residual_m
        fields, weight = placed.fields(slots), noise.weight / noise.floor_m2
        square = np.einsum("mck,m,mcl->mkl", fields, weight, fields, optimize=True)
        pull = np.einsum("mck,m,mc->mk", fields, weight, residual_m, optimize=True)
        out = np.empty_like(residual_m)
        for f in np.unique(self.all_folds):
            fit = (self.all_folds != f) & (noise.weight > 0)
            mine = self.all_folds == f
            if not fit.any():
                out[mine] = residual_m[mine]
                continue
            whole = square[fit].sum(axis=0)
            whole += 1e-9 * np.trace(whole) / len(whole) * np.eye(len(whole))
            out[mine] = residual_m[mine] - fields[mine] @ np.linalg.solve(whole, pull[fit].sum(axis=0))
        return out

    @cached_property
    def left_test(self) -> LeftTest:
        """Whether the largest evidence that is left for anything is what noise makes."""
        a = self.analysis
        groups = np.arange(len(a.problem.candidates))
        given = joined(a.given, self.chosen)
        score = a.evidence.gains(groups, given).evidence - a.problem.cost
        score[np.isin(groups, given.groups)] = -np.inf
        most = float(score.max())
        beyond = most - (a.threshold - NULL_MARGIN)
        p_value = float(min(1.0, (1 - NULL_QUANTILE) * np.exp(-beyond)))
        down_to_it = self.left_m2 <= NEAR_FLOOR**2 * self.floor_m2
        noise_like = (p_value > NOISE_LIKE or down_to_it) and a.noise.excess == 1
        return LeftTest("largest evidence left for any cause", p_value, noise_like)

    @cached_property
    def verdict(self) -> Verdict:
        within = self.left_m2 < BEYOND_NOISE**2 * self.expected_m2
        if not self.stands and self.analysis.noise.excess == 1 and within:
            return Verdict.NO_GAP
        if not self.named:
            return Verdict.UNEXPLAINED
        base = max(self.gap_m2 - self.floor_m2, 1e-3 * self.floor_m2)
        unknown = any(one.unknown for one in self.stands)
        nearly = (self.gap_m2 - self.left_m2) / base >= CLOSED and self.left_m2 <= NEARLY**2 * self.floor_m2
        closed = nearly or (self.left_test.left_is_noise and within)
        return Verdict.EXPLAINED if closed and not unknown else Verdict.PARTLY_EXPLAINED


def _report(campaign: Campaign, arm: CalibratedArm | None, found: Findings) -> Diagnosis:
    a = found.analysis
    causes = _causes(found)
    gap = found.verdict is not Verdict.NO_GAP
    wide, noise = found.wide, found.wide.noise
    placed = replace(a.placed, seen=found.seen)
    return Diagnosis(
        campaign=campaign,
        sim=a.sim.seen.sim,
        rows=found.seen.rows,
        difference_m=wide.residual_m,
        left_m=found.left_m,
        verdict=found.verdict,
        gap_rms_m=float(np.sqrt(found.gap_m2)),
        left_rms_m=float(np.sqrt(found.left_m2)),
        noise=_noise_model(campaign, found),
        causes=causes,
        where=where(placed, wide.residual_m, a.problem, a.evidence, gap),
        transfers=transfers(wide.problem, a.geometry_prior, wide.chosen(found.chosen)),
        left_test=found.left_test,
        limits=detection_limits(a.problem, a.evidence, a.threshold),
        rivals=_rivals(found, causes),
        outliers=tuple(
            Outlier(int(found.seen.record[k]), float(np.linalg.norm(found.left_m[k]))) for k in noise.outliers
        ),
        warnings=warnings_of(a.doings, noise, a.sim),
        evidence_map=_evidence_map(found) if gap else (),
        reliability=reliability(a.problem, a.evidence, a.threshold) if gap else None,
        hold_out=HOLD_OUT,
        corrected=_corrected(arm, found),
        within_calibration_rms_m=found.within_calibration_m,
    )


def _noise_model(campaign: Campaign, found: Findings) -> NoiseModel:
    noise = found.analysis.noise
    used = float(np.sqrt(np.trace(noise.covariance_m2, axis1=1, axis2=2).mean() / 3))
    repeats = noise.source == "replicates"
    stated = campaign.instrument.sigma_m
    return NoiseModel(
        stated_m=stated,
        used_m=used,
        source=noise.source,
        degrees_of_freedom=float(noise.freedom),
        tail_degrees=float(noise.tails),
        correlation=float(noise.memory),
        floor_rms_m=float(np.sqrt(found.floor_m2)),
        floor_source="repeats" if repeats else "sigma" if noise.stated else "unknown",
    )


def _causes(found: Findings) -> tuple[Cause, ...]:
    """Every cause with what it closes: alone, in its turn, and last."""
    total = max(found.gap_m2 - found.floor_m2, 1e-3 * found.floor_m2)
    base = found.square_m2(Chosen())
    so_far, before, out = Chosen(), base, []
    for stand in found.stands:
        own = chosen_of([stand])
        others = chosen_of([one for one in found.named if one is not stand])
        so_far = joined(so_far, own)
        after = found.square_m2(so_far)
        last = found.square_m2(others) - found.square_m2(joined(others, own))
        probability, alike = _probability(found, stand, others)
        out.append(
            Cause(
                place=stand.place,
                probability=probability,
                twins=alike,
                parameters=_parameters(found, stand),
                gap_before_rms_m=float(np.sqrt(before)),
                gap_after_rms_m=float(np.sqrt(after)),
                share_closed=float((base - found.square_m2(own)) / total),
                share_closed_last=float(last / total),
                shift_m=_shift(found, stand),
            )
        )
        before = after
    return tuple(out)


def _probability(found: Findings, stand: Stand, others: Chosen) -> tuple[float, tuple[Place, ...]]:
    if stand.unknown:
        return UNKNOWN_FIRST if stand is found.stands[0] else UNKNOWN_BESIDE, (stand.place,)
    if found.told:
        return 1.0, (stand.place,)
    if stand.groups[0] in found.analysis.given.groups:
        # The geometry as a whole is settled by points kept out; this is about the one frame.
        return _significance(found, stand), (stand.place,)
    probability, alike = twins(found.judge, stand, others, rivals(found.judge, stand, others))
    beside = BESIDE_UNKNOWN if found.stands[0].unknown else 1.0
    if floats(found.judge, stand, found.named):
        beside = min(beside, AT_BEST)
    return beside * probability * adequate(found.judge, chosen_of(found.named), chosen_of(found.stands)), alike


def _significance(found: Findings, stand: Stand) -> float:
    """Probability that a cause does anything at all, when everything else is given."""
    a = found.analysis
    rest = without(joined(a.given, found.worth), stand.groups)
    return float(1 / (1 + np.exp(-a.evidence.gains(np.array(stand.groups), rest).evidence[0])))


def _parameters(found: Findings, stand: Stand) -> tuple[Parameter, ...]:
    if stand.unknown:
        return ()
    problem, chosen = found.wide.problem, found.wide.chosen(found.chosen)
    first = found.wide.number[stand.groups[0]]
    _, numbers, covariance = found.honest.fitted(chosen)
    at = _position(problem, chosen, first)
    candidate = problem.candidates[first]
    scale = problem.design.scale[problem.slices[first]]
    own = slice(at, at + len(scale))
    stds = np.sqrt(np.diag(covariance)[own]) * scale
    values = numbers[own] * scale
    fitted = [Parameter(n, float(v), float(s)) for n, v, s in zip(candidate.names, values, stds, strict=True)]
    return (*fitted, *(Parameter(name, value, float("nan")) for name, value in candidate.fixed))


def _position(problem: Problem, chosen: Chosen, group: int) -> int:
    """Where a chosen candidate's columns begin among those of a fit."""
    at = problem.nuisance
    for g in chosen.groups:
        if g == group:
            return at
        at += problem.slices[g].stop - problem.slices[g].start
    raise ValueError(f"candidate {group} is not among the chosen")


def _shift(found: Findings, stand: Stand) -> Array:
    """What one cause moves when all are fitted together, (m, 3)."""
    problem = found.wide.problem
    chosen = found.wide.chosen(joined(found.chosen, chosen_of([stand])))
    index, numbers, _ = found.kept.fitted(chosen)
    out = np.zeros_like(problem.residual_m)
    for g in found.wide.chosen(chosen_of([stand])).groups:
        at = _position(problem, chosen, g)
        own = slice(at, at + problem.slices[g].stop - problem.slices[g].start)
        out += found.kept.plain[:, :, index[own]] @ numbers[own]
    return out


def _rivals(found: Findings, causes: tuple[Cause, ...]) -> tuple[Rivals, ...]:
    return tuple(advice(found.analysis, cause.twins) for cause in causes if len(cause.twins) > 1)


def _evidence_map(found: Findings) -> tuple[Cell, ...]:
    """Every named effect and place when it stands alone, for those that say anything."""
    a, best = found.analysis, _best_closure(found)
    total = max(2 * float(np.max(a.found.alone, initial=0.0)), 1e-300)
    cells: dict[tuple[object, ...], Cell] = {}
    for k in a.problem.named:
        place, score = a.problem.candidates[k].place, float(a.found.alone[k])
        if np.isfinite(score) and (place.identity not in cells or score > cells[place.identity].evidence):
            closed = min(max(2 * score / total, 0.0), 1.0) * best
            cells[place.identity] = Cell(place, score, closed)
    return tuple(cells.values())


def _best_closure(found: Findings) -> float:
    if not found.named:
        return 0.0
    base = found.square_m2(Chosen())
    total = max(found.gap_m2 - found.floor_m2, 1e-300)
    return float((base - found.square_m2(chosen_of(found.named[:1]))) / total)


def _corrected(arm: CalibratedArm | None, found: Findings) -> CorrectedSim:
    problem, chosen = found.wide.problem, found.wide.chosen(found.chosen)
    _, numbers, _ = found.honest.fitted(chosen)
    own = [problem.design.scale[problem.slices[g]] for g in chosen.groups]
    scaled = numbers * np.concatenate([problem.design.scale[: problem.nuisance], *own])
    certain = problem.nuisance - problem.doubt
    slots = [column[0][0] for column in problem.design.columns[:certain]]
    geometry = tuple((slots[k], float(scaled[k])) for k in range(problem.placement, certain))
    at, values = problem.nuisance, []
    for part in own:
        values.append(scaled[at : at + len(part)])
        at += len(part)
    causes = tuple(problem.candidates[g] for g in chosen.groups)
    doubt = scaled[certain : problem.nuisance]
    return CorrectedSim(arm, causes, tuple(values), geometry, doubt, found.seen.campaign.digest)
