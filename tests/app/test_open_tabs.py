"""Tabs that somebody looks at are drawn at once, others later, and never with what is out of date."""

from app.panels.open_tabs import OpenTabs


def test_a_tab_that_is_open_somewhere_is_drawn_at_once():
    tabs, drawn = OpenTabs(), []
    assert tabs.heard(1, "seen:axes")
    tabs.draw("axes", lambda: drawn.append("axes"))
    tabs.draw("drives", lambda: drawn.append("drives"))
    assert drawn == ["axes"]
    tabs.catch_up()
    tabs.catch_up()
    assert drawn == ["axes", "drives"]


def test_a_tab_is_drawn_when_it_is_opened_and_only_with_the_latest():
    tabs, drawn = OpenTabs(), []
    tabs.draw("drives", lambda: drawn.append("old"))
    tabs.draw("drives", lambda: drawn.append("new"))
    tabs.heard(7, "seen:drives")
    tabs.heard(7, "seen:drives")
    assert drawn == ["new"]


def test_a_browser_that_left_counts_no_more():
    tabs, drawn = OpenTabs(), []
    tabs.heard(1, "seen:axes")
    tabs.left(1)
    tabs.left(2)
    tabs.draw("axes", lambda: drawn.append("axes"))
    assert drawn == []


def test_other_words_are_for_others():
    tabs = OpenTabs()
    assert not tabs.heard(1, "2-a_m")
    assert tabs.heard(1, "seen:there is no such tab")
