"""How good blind diagnoses were, held against the answers. Nothing here reads or writes anything."""

from collections import Counter
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from core.gap.blind_answers import OTHER, Answer, Answers
from core.gap.blind_check import Said, SaidCause
from core.gap.result import UNKNOWN, Verdict
from core.geometry import Array

BINS = 10
"""Of equal width, for the calibration of probabilities."""
CONFIDENT = 0.5
"""A single name with more than this probability is a claim."""
NOTHING, NOT_SAID, ELSEWHERE, NOT_READ = "nothing wrong", "not said", "right effect elsewhere", "not diagnosed"
GAP_SEEN = (Verdict.UNEXPLAINED, Verdict.PARTLY_EXPLAINED)


@dataclass(frozen=True)
class Share:
    """How many of how many."""

    count: int
    of: int

    @property
    def share(self) -> float:
        """NaN: of none."""
        return self.count / self.of if self.of else np.nan


@dataclass(frozen=True)
class TopOne:
    """Whether the strongest cause that was said is one of those that are there."""

    exact: Share
    """Effect and place."""
    up_to_class: Share
    """The same, or one of the causes that were declared inseparable from it."""
    joint: Share
    """The joint, whatever the effect; only where the answer names one."""


@dataclass(frozen=True)
class Case:
    """One campaign with its answer, and how the two compare."""

    said: Said
    answers: tuple[Answer, ...]
    also: tuple[Answer, ...]
    """What is there as well without being asked for."""
    exact: tuple[int | None, ...]
    """For every answer the cause that met it by name, by index; each meets one at most."""
    up_to_class: tuple[int | None, ...]
    """The same, met by name or by its class."""

    @property
    def empty(self) -> bool:
        return not self.answers

    @property
    def beyond(self) -> bool:
        """Whether something acts for which the program has no candidate."""
        return any(answer.effect == OTHER for answer in self.answers)

    @property
    def detected(self) -> bool:
        """Whether it was said that something without a name is there."""
        return self.said.verdict in GAP_SEEN or any(c.place.effect == UNKNOWN for c in self.said.causes)

    @property
    def alarmed(self) -> bool:
        """Whether a gap was claimed, beyond what is there as well."""
        causes = self.said.causes
        if self.also and causes:
            return not all(_meets_any(cause, self.also) for cause in causes)
        return self.said.verdict is not Verdict.NO_GAP or bool(causes)

    @property
    def there(self) -> tuple[Answer, ...]:
        """All that is there, asked for or not."""
        return (*self.answers, *self.also)

    @property
    def wrong_names(self) -> tuple[SaidCause, ...]:
        """Single names, said with confidence, of effects that are not there."""
        sure = [c for c in self.said.causes if len(c.places) == 1 and c.probability > CONFIDENT]
        return tuple(c for c in sure if c.place.effect != UNKNOWN and not _meets_any(c, self.there))

    @property
    def share_closed(self) -> float:
        """Of gap^2 - floor^2, by all causes together; NaN: there was no gap to close."""
        said = self.said
        gap = said.gap_rms_m**2 - said.floor_rms_m**2
        return 1 - (said.left_rms_m**2 - said.floor_rms_m**2) / gap if gap > 0 else np.nan


@dataclass(frozen=True)
class Calibration:
    """Whether probabilities mean what they say."""

    claims: int
    brier: float
    """Mean square of probability less outcome."""
    expected_error: float
    """Mean over claims of |probability - share of right ones| by bins."""
    said: Array
    """Mean probability of each bin that is not empty, (k,)."""
    right: Array
    """Share of right ones, (k,)."""
    count: np.ndarray
    """Claims in it, (k,)."""


@dataclass(frozen=True)
class SetMeasures:
    """What was said of mixtures as a set; means over campaigns."""

    campaigns: int
    precision: float
    precision_up_to_class: float
    recall: float
    recall_up_to_class: float
    all_found: Share
    """Campaigns of which every effect was found, up to class."""


@dataclass(frozen=True)
class Score:
    """The whole comparison."""

    cases: tuple[Case, ...]
    not_diagnosed: tuple[str, ...]
    """Names of campaigns that have an answer and no diagnosis; every figure counts them as missed."""
    single: TopOne
    mixture: TopOne
    sets: SetMeasures
    false_alarms: Share
    other_detected: Share
    other_named_wrongly: Share
    """Campaigns with such an effect and a confident single wrong name."""
    wrong_names: Share
    """Campaigns with a confident single wrong name, of all."""
    by_name: Calibration
    """Right: effect and place are both right."""
    by_class: Calibration
    """Right: one of the declared class is."""
    median_closed: float
    tenth_closed: float
    """10th percentile."""
    confusion: "Confusion"


@dataclass(frozen=True)
class Confusion:
    """What was there against what was said of it first."""

    rows: tuple[str, ...]
    columns: tuple[str, ...]
    counts: np.ndarray
    """(rows, columns)"""


def score(said: tuple[Said, ...], answers: Answers) -> Score:
    """Hold what was said against the answers; campaigns without an answer are left out."""
    cases = tuple(_case(one, answers[one.name]) for one in said if one.name in answers)
    read = tuple(case for case in cases if case.said.verdict is not None)
    named = [case for case in cases if case.answers and not case.beyond]
    beyond = [case for case in cases if case.beyond]
    closed = np.array([case.share_closed for case in read if case.answers])
    closed = closed[np.isfinite(closed)]
    return Score(
        cases=cases,
        not_diagnosed=tuple(case.said.name for case in cases if case.said.verdict is None),
        single=_top_one([case for case in named if len(case.answers) == 1]),
        mixture=_top_one([case for case in named if len(case.answers) > 1]),
        sets=_sets([case for case in cases if len(case.answers) > 1]),
        false_alarms=_share([case.alarmed for case in read if case.empty]),
        other_detected=_share([case.said.verdict is not None and case.detected for case in beyond]),
        other_named_wrongly=_share([bool(case.wrong_names) for case in beyond]),
        wrong_names=_share([bool(case.wrong_names) for case in cases]),
        by_name=_calibration([(c.probability, _is_right(c, case, False)) for case in read for c in case.said.causes]),
        by_class=_calibration([(c.probability, _is_right(c, case, True)) for case in read for c in case.said.causes]),
        median_closed=float(np.median(closed)) if len(closed) else np.nan,
        tenth_closed=float(np.quantile(closed, 0.1)) if len(closed) else np.nan,
        confusion=_confusion(cases),
    )


def _case(said: Said, there: tuple[Answer, ...]) -> Case:
    answers, also = (tuple(a for a in there if a.asked is asked) for asked in (True, False))
    exact = np.array([[a.is_met_by(c.place) for c in said.causes] for a in answers], dtype=bool)
    loose = np.array([[any(a.is_met_by(p) for p in c.places) for c in said.causes] for a in answers], dtype=bool)
    shape = (len(answers), len(said.causes))
    exact, loose = exact.reshape(shape), loose.reshape(shape)
    return Case(said, answers, also, _matched(exact), _matched(loose, exact))


def _matched(allowed: np.ndarray, preferred: np.ndarray | None = None) -> tuple[int | None, ...]:
    """The pairing of rows with columns that meets most rows, preferred pairs first where that costs none."""
    worth = allowed.astype(float) * (len(allowed) + 1)
    if preferred is not None:
        worth += preferred & allowed
    found: list[int | None] = [None] * len(allowed)
    for row, column in zip(*linear_sum_assignment(-worth), strict=True):
        if allowed[row, column]:
            found[int(row)] = int(column)
    return tuple(found)


def _meets_any(cause: SaidCause, answers: tuple[Answer, ...]) -> bool:
    return any(answer.is_met_by(cause.place) for answer in answers)


def _meets(cause: SaidCause, answers: tuple[Answer, ...], up_to_class: bool) -> bool:
    places = cause.places if up_to_class else (cause.place,)
    return any(answer.is_met_by(place) for answer in answers for place in places)


def _is_right(cause: SaidCause, case: Case, up_to_class: bool) -> bool:
    return _meets(cause, case.there, up_to_class)


def _first(case: Case) -> SaidCause | None:
    """The strongest cause that was said."""
    return case.said.causes[0] if case.said.causes else None


def _share(outcomes: list[bool]) -> Share:
    return Share(sum(outcomes), len(outcomes))


def _top_one(cases: list[Case]) -> TopOne:
    first = [(case, _first(case)) for case in cases]
    placed = [(case, c, {a.joint for a in case.answers if a.joint}) for case, c in first]
    return TopOne(
        exact=_share([c is not None and _meets(c, case.answers, False) for case, c in first]),
        up_to_class=_share([c is not None and _meets(c, case.answers, True) for case, c in first]),
        joint=_share([c is not None and _at_joint(c, case, joints) for case, c, joints in placed if joints]),
    )


def _at_joint(cause: SaidCause, case: Case, joints: set[int]) -> bool:
    """Whether a cause sits at one of the joints, or is right and sits at none."""
    return cause.place.joint in joints or (cause.place.joint is None and _meets(cause, case.answers, False))


def _sets(cases: list[Case]) -> SetMeasures:
    """Unknown causes are abstentions and count neither for nor against, unless the answer is of that kind."""
    precision, precision_class, recall, recall_class, complete = [], [], [], [], []
    for case in cases:
        met, met_class = (sum(k is not None for k in m) for m in (case.exact, case.up_to_class))
        claims = sum(c.place.effect != UNKNOWN and not _meets_any(c, case.also) for c in case.said.causes)
        claims += sum(k is not None and a.effect == OTHER for a, k in zip(case.answers, case.exact, strict=True))
        if claims:
            precision.append(min(met / claims, 1.0))
            precision_class.append(min(met_class / claims, 1.0))
        recall.append(met / len(case.answers))
        recall_class.append(met_class / len(case.answers))
        complete.append(met_class == len(case.answers))
    means = (float(np.mean(v)) if v else np.nan for v in (precision, precision_class, recall, recall_class))
    return SetMeasures(len(cases), *means, all_found=_share(complete))


def _calibration(claims: list[tuple[float, bool]]) -> Calibration:
    if not claims:
        nothing = np.zeros(0)
        return Calibration(0, np.nan, np.nan, nothing, nothing, np.zeros(0, dtype=int))
    said, right = np.array(claims, dtype=float).T
    which = np.minimum((said * BINS).astype(int), BINS - 1)
    which = np.unique(which, return_inverse=True)[1]
    count = np.bincount(which)
    mean_said, mean_right = (np.bincount(which, v) / count for v in (said, right))
    return Calibration(
        claims=len(said),
        brier=float(np.mean((said - right) ** 2)),
        expected_error=float(np.sum(count * np.abs(mean_said - mean_right)) / len(said)),
        said=mean_said,
        right=mean_right,
        count=count,
    )


def _confusion(cases: tuple[Case, ...]) -> Confusion:
    """One row for every kind of effect that is there, one column for every kind that was said of it."""
    pairs = Counter(pair for case in cases for pair in _pairs(case))
    rows = sorted({row for row, _ in pairs}, key=lambda name: (name in (NOTHING, OTHER), name))
    last = (UNKNOWN, ELSEWHERE, NOTHING, NOT_SAID, NOT_READ)
    columns = sorted({column for _, column in pairs}, key=lambda name: (name in last, name))
    counts = np.array([[pairs[row, column] for column in columns] for row in rows], dtype=int)
    return Confusion(tuple(rows), tuple(columns), counts.reshape(len(rows), len(columns)))


def _pairs(case: Case) -> list[tuple[str, str]]:
    """What is there and what was said of it: of an effect alone the strongest cause, of several the one that met it."""
    causes = case.said.causes
    there = [answer.effect for answer in case.answers] or [NOTHING]
    if case.said.verdict is None:
        return [(effect, NOT_READ) for effect in there]
    if len(case.answers) > 1:
        return [
            (answer.effect, _met_as(answer, causes, k))
            for answer, k in zip(case.answers, case.up_to_class, strict=True)
        ]
    if not causes:
        return [(there[0], NOTHING if case.said.verdict is Verdict.NO_GAP else NOT_SAID)]
    said = causes[0].place.effect
    elsewhere = bool(case.answers) and said == there[0] and not case.answers[0].is_met_by(causes[0].place)
    return [(there[0], ELSEWHERE if elsewhere else said)]


def _met_as(answer: Answer, causes: tuple[SaidCause, ...], k: int | None) -> str:
    if k is not None:
        return causes[k].place.effect
    return ELSEWHERE if any(c.place.effect == answer.effect for c in causes) else NOT_SAID
