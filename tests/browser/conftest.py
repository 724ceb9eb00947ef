"""A machine that is busy with something else may keep a browser waiting for longer than any test should wait."""

from pathlib import Path

import pytest

HERE = Path(__file__).parent


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Who waited in vain asks once more; what was seen and is wrong fails at once."""
    for item in items:
        if HERE in item.path.parents:
            item.add_marker(pytest.mark.flaky(reruns=1, only_rerun=["TimeoutError", "it did not happen"]))
