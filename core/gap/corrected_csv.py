"""Where the corrected sim has the points of a campaign, as a table whose columns a campaign may carry as its sim."""

import csv
import io

from core.gap.result import GapReport

HEADER = ("record", "target", "sim_x_mm", "sim_y_mm", "sim_z_mm")


def corrected_to_csv(report: GapReport) -> str:
    """One row a point of the gap, in the instrument's frame, base and targets placed."""
    table, rows = report.campaign.measurements, report.rows
    points_mm = 1e3 * (table.point_m[rows] - report.left_m)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(HEADER)
    for record, target, point in zip(table.record[rows], table.target[rows], points_mm, strict=True):
        name = report.campaign.targets[target].name
        writer.writerow((int(record), name, *(f"{coordinate:.5f}" for coordinate in point)))
    return text.getvalue()
