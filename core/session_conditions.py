"""The conditions that an operator enters once and every shot then carries: temperature of the air, payload."""

from dataclasses import dataclass, replace

from core.errors import InputError
from core.input_files import shown
from core.instruments import Reading
from core.session_events import Setting
from core.session_state import State

LIMITS = {"temperature_c": (-60.0, 100.0), "payload_kg": (0.0, 1e5)}
"""Keys of the session's settings, and what is possible."""
NAMES = {"temperature_c": "air temperature [°C]", "payload_kg": "payload [kg]"}


@dataclass(frozen=True)
class Conditions:
    """What is known about a shot beside what the instrument says; None: not known."""

    temperature_c: float | None = None
    """Of the air."""
    payload_kg: float | None = None

    def noted(self, reading: Reading) -> Reading:
        """A reading with the temperature, unless the instrument measured that itself."""
        return reading if reading.temperature_c is not None else replace(reading, temperature_c=self.temperature_c)


def conditions_of(state: State) -> Conditions:
    """The conditions that stand in a session now."""
    values = {key: state.settings.get(key) for key in LIMITS}
    return Conditions(**{k: float(v) if isinstance(v, int | float) else None for k, v in values.items()})


def condition_events(texts: dict[str, str], state: State) -> list[Setting]:
    """What changes when an operator enters conditions; an empty text takes one away.

    Args:
        texts: what was typed, by the keys of ``LIMITS``.

    Raises:
        InputError: a text is no number, or not a possible one.
    """
    events = []
    for key, text in texts.items():
        value = _number(key, text.strip()) if text.strip() else None
        if value != state.settings.get(key):
            events.append(Setting(key, value))
    return events


def _number(key: str, text: str) -> float:
    low, high = LIMITS[key]
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not low <= value <= high:
        raise InputError(f"{NAMES[key]}: {shown(text)}, expected a number from {low:g} to {high:g}, or nothing")
    return value
