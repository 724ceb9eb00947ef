"""Every term that the page uses, in one place: shown on hover where a term stands, and all together in Help."""

from html import escape

from app.report_words import TERMS as OF_THE_REPORT

OF_THE_PAGE = (
    ("Arc", "The part of a circle on which a target moves while one joint turns."),
    ("Base", "The part of the robot that stands on the floor. Its frame is where the robot's description begins."),
    ("Campaign", "A folder of campaign.toml, robot.toml and measurements.csv: all that was measured, for any program."),
    (
        "Chance",
        "How often noise alone would put a shot so far out, judged by the other shots of its sweep. Below 2 % a shot "
        "is doubtful, below 0.01 % it is to be measured again.",
    ),
    ("Command", "What is sent to the robot's controller: one number a joint, degrees or millimetres."),
    ("Drive", "Motor, gear and transducer of a joint. Its function says what the joint makes of a command."),
    ("Excluded", "Left out of every fit, with a reason. The shot is kept in the session and can be included again."),
    ("Expected place", "Where the target should be seen: by the axis of this sweep, or before by the nominal arm."),
    (
        "Family",
        "The kind of function that a drive is given: direct, ratio, first harmonic, gear, harmonics. With auto the "
        "most probable one is chosen, and the reason is said.",
    ),
    (
        "Forward, return pass",
        "A sweep may be made forwards and then backwards over the same stops: it shows lost motion.",
    ),
    ("Home", "The commands at the arm's marks, where every joint stands at zero."),
    ("Link", "The part of the arm between two joints. Link k moves with joints 1 to k; link 0 is the floor."),
    (
        "Net radial repeatability",
        "Standard deviation of the distance of repeated shots from their mean, in space. An instrument with the stated "
        "noise σ in each coordinate shows √3 σ.",
    ),
    ("Nominal", "As designed, before any measurement."),
    ("Seat", "One browser acts at a time. The others watch live and can take the operator's seat."),
    ("Session", "One file that keeps all that is measured and decided, in its order. Nothing in it is ever deleted."),
    ("Shot", "One measured point of one target, with the command under which it was taken."),
    ("Span", "How far a joint moves in a sweep."),
    ("Stop", "A standstill of a sweep at which targets are measured."),
    (
        "Stated noise",
        "What the instrument promises: standard deviation of one coordinate of a point. It is checked, not believed.",
    ),
    ("Target", "A point that the instrument can see, fixed to a link: a reflector, a mark, a ball."),
    ("Transmission error", "Commanded less actual displacement of a joint, as the sweep shows it."),
    ("Undo", "Takes back the last shot or decision, without end. It stays in the file, and redo brings it back."),
)
TERMS = dict(sorted((*OF_THE_PAGE, *OF_THE_REPORT), key=lambda pair: pair[0].casefold()))
"""Explanation of each term."""


def term(word: str, name: str) -> str:
    """A word of the page that explains itself on hover; ``name`` is its term."""
    return f"<abbr title='{escape(TERMS[name])}'>{escape(word)}</abbr>"
