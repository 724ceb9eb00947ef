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


def test_a_share_fills_the_bar_and_texts_of_files_do_nothing_to_the_terminal() -> None:
    stream = Terminal()
    with Progress(1, stream) as progress:
        for done in (0.0, 0.5, 1.0, 1.7):
            progress.share(done, "a\x1b[2J\nb" + "c" * 200)
    lines = stream.getvalue().split("\r\x1b[K")[1:-1]
    assert [line.count("#") for line in lines] == [0, 10, 20, 20]
    assert all(line.isprintable() and len(line) < 100 for line in lines)
