"""Everything that trueaxis raises on purpose.

    TrueaxisError
    ├── InputError            what was given is wrong; the sentence names place, value and what was expected
    │   ├── CampaignError     a campaign folder, its measurements or its description
    │   ├── RobotError        the description of a robot
    │   ├── AxisUndefined     these points cannot define a joint axis
    │   └── SessionError      a session file or an event cannot be used (in session_events)
    ├── InstrumentFailed      an instrument or a robot did not do what it was asked for (in instruments)
    └── NotConverged          an iteration did not reach its answer

Every message is one sentence that can be shown to a person as it is.
"""


class TrueaxisError(Exception):
    """Base of every error that trueaxis raises on purpose."""


class InputError(TrueaxisError):
    """What was given is wrong: the message names the place, the value and what was expected."""


class CampaignError(InputError):
    """A campaign folder, its measurements or its description cannot be used."""


class RobotError(InputError):
    """The description of a robot cannot be used."""


class AxisUndefined(InputError):
    """The points of a sweep cannot define a joint axis; the message says why."""


class NotConverged(TrueaxisError):
    """An iteration did not reach its answer."""
