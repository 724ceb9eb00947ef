"""What the literature does instead of calibrating joint by joint, on the same data and the same ``Robot``.

Read in this order: ``observed.py`` (the points), ``equations.py`` (the aggregate model: position only, full pose),
``aggregate.py`` (least squares), ``kalman.py`` (pose by pose), ``circle_point.py`` (axis by axis),
``denavit_hartenberg.py`` (other parameters), ``comparison.py`` (all of them on kept-out poses), ``verdict.py`` (what it
comes to).
"""
