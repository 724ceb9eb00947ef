"""The diagnosis under test, called as a user's script would."""

import inspect
import json
import time
import traceback
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

from core.campaign_files import read_campaign
from core.errors import TrueaxisError

Json = dict[str, object]


@dataclass(frozen=True)
class Product:
    """What the suite needs of a diagnosis."""

    diagnose: Callable[..., object]
    """campaign -> report; ``told=[{"effect": ..., ...}]`` fits these causes alone, ``without=(name, ...)`` searches a
    library that lacks some effects."""
    to_json: Callable[[object], str]
    """report -> text of gap.json."""
    realised: Callable[[object, object], float]
    """report, another campaign of the same arm -> share of gap^2 - floor^2 closed there."""

    @property
    def can_forget(self) -> bool:
        """Whether effects can be taken out of its library."""
        return "without" in inspect.signature(self.diagnose).parameters


def own_product() -> Product:
    """The diagnosis of this project."""
    from core.gap.corrected import realised_closure
    from core.gap.diagnosis import diagnose
    from core.gap.gap_json import gap_to_json

    return Product(diagnose, gap_to_json, realised_closure)


@dataclass(frozen=True)
class Verdict:
    """What was said of one campaign."""

    gap: Json | None
    """gap.json; None where nothing was said."""
    seconds: float
    refused: str = ""
    """The sentence with which the product would not answer."""
    crashed: str = ""
    """Last lines of what went wrong, if it did."""
    realised: float | None = None
    """Closure on another day at the same arm."""
    not_realised: str = ""
    """Why there is none though there is another day."""

    def write(self, path: Path) -> None:
        path.write_text(json.dumps(asdict(self), indent=1))

    @classmethod
    def read(cls, path: Path) -> "Verdict":
        return cls(**json.loads(path.read_text()))


def ask(product: Product, folder: Path, fresh: Path | None = None, **how: object) -> Verdict:
    """The verdict on a campaign folder; ``fresh`` is another day's folder, if there is one."""
    begun = time.perf_counter()
    try:
        report = product.diagnose(read_campaign(folder), **how)
        seconds = time.perf_counter() - begun
        gap = json.loads(product.to_json(report))
    except TrueaxisError as refusal:
        return Verdict(None, time.perf_counter() - begun, refused=str(refusal))
    except Exception:
        # A crash is a result of its own: it is counted and listed, and the others go on.
        return Verdict(None, time.perf_counter() - begun, crashed=_last_lines())
    return Verdict(gap, seconds, **_another_day(product, report, fresh))


def _another_day(product: Product, report: object, fresh: Path | None) -> Json:
    if fresh is None:
        return {}
    try:
        return {"realised": float(product.realised(report, read_campaign(fresh)))}
    except Exception:
        return {"not_realised": _last_lines()}


def _last_lines() -> str:
    return traceback.format_exc()[-800:]
