"""The report of a calibration: one page of HTML that holds everything it shows."""

from html import escape

from core.calibration import Calibration
from core.report import tables


def report_html(calibration: Calibration) -> str:
    """The report as one self-contained page."""
    title = escape(calibration.campaign.title or calibration.campaign.robot.name)
    parts = [f"<h2>{escape(t.title)}</h2>{t.frame.to_html(index=False, escape=True)}" for t in tables(calibration)]
    return f"<!doctype html><meta charset=utf-8><title>{title}</title><h1>{title}</h1>{''.join(parts)}"
