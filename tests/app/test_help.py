"""Help: every key that the page takes and every term that it explains is there."""

import re
from pathlib import Path

from app import glossary, keys
from app.panels.help import help_words

APP = Path(glossary.__file__).parent


def test_every_term_that_the_page_uses_is_explained():
    used = set()
    for path in APP.rglob("*.py"):
        used |= set(
            re.findall(
                r"""\bterm\(\s*(?:f?['"][^'"]*['"]|[^,()]+(?:\([^()]*\))?[^,()]*)\s*,\s*['"]([^'"]+)['"]""",
                path.read_text(),
            )
        )
    assert len(used) > 8
    assert used <= glossary.TERMS.keys()
    text = help_words(keys.KEYS)
    assert all(name.split(",")[0] in text for name in glossary.TERMS)


def test_keys_are_listed_once_and_each_has_its_own():
    hotkeys = [key.hotkey for key in keys.KEYS]
    assert len(set(hotkeys)) == len(hotkeys)
    text = help_words(keys.KEYS)
    for key in keys.KEYS:
        assert f"<b>{key.shown}</b></td><td>{key.does}</td>" in text


def test_a_term_explains_itself_on_hover_and_is_escaped():
    assert glossary.term("<b>", "Stop").startswith("<abbr title='A standstill")
    assert "&lt;b&gt;</abbr>" in glossary.term("<b>", "Stop")


def test_terms_are_sorted_and_end_as_sentences():
    names = list(glossary.TERMS)
    assert names == sorted(names, key=str.casefold)
    assert all(text.endswith(".") and len(text) < 300 for text in glossary.TERMS.values())
