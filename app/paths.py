"""Where the files that come with trueaxis are: in a checkout beside the package, in an installation inside it."""

from pathlib import Path

PACKAGE = Path(__file__).resolve().parent


def static_folder() -> Path:
    """The folder of styles, templates and shapes.

    Raises:
        FileNotFoundError: the installation is not complete.
    """
    return _folder("static")


def sample_folder() -> Path:
    """The folder of sample data, one folder a sample.

    Raises:
        FileNotFoundError: the installation is not complete.
    """
    return _folder("sample_data")


def _folder(name: str) -> Path:
    for place in (PACKAGE / name, PACKAGE.parent / name):
        if place.is_dir():
            return place
    raise FileNotFoundError(f"the folder {name} that belongs to trueaxis is missing; expected it in {PACKAGE}")
