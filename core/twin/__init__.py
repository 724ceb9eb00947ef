"""Simulated arms with known faults, measured by simulated instruments: what no real robot can offer is the truth.

Nothing else in ``core`` imports this package. Data that it makes are simulated and say so in their title and notes.

    cell        what a simulated cell is: nominal robot, true arm, targets, instrument, order of measurement
    protocol    which joint moves when, and where every motor comes from
    forward     where the targets truly are
    effects     faults that can be added, by name, joint and size
    noise       the arm's repeatability; instruments: what is read instead of the truth
    campaign    all of it together: one simulated campaign
    irb_l6, scara   two cells
"""
