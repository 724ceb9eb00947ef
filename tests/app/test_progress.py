"""A line on a terminal, nothing in a pipe."""

import io

import pytest

from app.progress import Progress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def work(stream: io.StringIO) -> None:
    with Progress(2, stream) as progress:
        progress.step("reading")
        progress.step("writing")


def fail(stream: io.StringIO) -> None:
    with Progress(2, stream) as progress:
        progress.step("reading")
        raise ZeroDivisionError


def test_a_pipe_sees_nothing() -> None:
    stream = io.StringIO()
    work(stream)
    assert stream.getvalue() == ""


def test_a_terminal_sees_each_step_on_one_line_that_is_cleared_at_the_end() -> None:
    stream = Terminal()
    work(stream)
    steps = stream.getvalue().split("\r\x1b[K")
    assert [step.split("] ")[-1] for step in steps] == ["", "1/2 reading", "2/2 writing", ""]
    assert steps[1].count("#") < steps[2].count("#")
    assert "\n" not in stream.getvalue()


def test_the_line_is_cleared_when_the_work_fails() -> None:
    stream = Terminal()
    with pytest.raises(ZeroDivisionError):
        fail(stream)
    assert stream.getvalue().endswith("\r\x1b[K")
