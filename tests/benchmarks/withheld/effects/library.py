"""Every effect of the contract's table under its name there."""

from collections.abc import Callable

import numpy as np

from tests.benchmarks.withheld.arms import Arm
from tests.benchmarks.withheld.effects.drives import Eccentricity, Latency, Mesh, Quantisation, Ratio, ZeroOffset
from tests.benchmarks.withheld.effects.effect import Effect
from tests.benchmarks.withheld.effects.instruments import Scale
from tests.benchmarks.withheld.effects.lost_motion import Backlash, Hysteresis
from tests.benchmarks.withheld.effects.mechanisms import Coupling, Linkage
from tests.benchmarks.withheld.effects.places import AxisWobble, Geometry
from tests.benchmarks.withheld.effects.times import BaseShift, Drift, TargetSlip, Thermal
from tests.benchmarks.withheld.effects.weights import Compliance, Flexure, Payload

Draw = Callable[[Arm, np.random.Generator], Effect]

NAMED: dict[str, Draw] = {
    "geometry": Geometry.draw,
    "zero_offset": ZeroOffset.draw,
    "ratio": Ratio.draw,
    "eccentricity": Eccentricity.draw,
    "mesh": Mesh.draw,
    "backlash": Backlash.draw,
    "compliance": Compliance.draw,
    "coupling": Coupling.draw,
    "axis_wobble": AxisWobble.draw,
    "latency": Latency.draw,
    "thermal": Thermal.draw,
    "drift": Drift.draw,
    "base_shift": BaseShift.draw,
    "target_slip": TargetSlip.draw,
    "scale": Scale.draw,
    "hysteresis": Hysteresis.draw,
    "flexure": Flexure.draw,
    "payload": Payload.draw,
    "linkage": Linkage.draw,
    "quantisation": Quantisation.draw,
}
