"""A tab that is there only while there is something to do in it."""

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import viser


class LateTab:
    """A tab that comes and goes."""

    def __init__(
        self,
        group: "viser.GuiTabGroupHandle | viser.PanelHandle",
        label: str,
        build: Callable[[], None],
        before: str | tuple[str, ...] = (),
    ) -> None:
        """Nothing is shown yet.

        Args:
            group: the row of tabs.
            label: of this one.
            build: fills it, within its context.
            before: labels of tabs that it comes before, the first of them that is there; none: at the end.
        """
        self._group, self._label, self._build = group, label, build
        self._before = (before,) if isinstance(before, str) else before
        self._tab: viser.GuiTabHandle | None = None

    @property
    def there(self) -> bool:
        return self._tab is not None

    def show(self, wanted: bool) -> None:
        """Make the tab, or take it away with all that is in it."""
        if wanted and self._tab is None:
            self._tab = self._group.add_tab(self._label)
            with self._tab:
                self._build()
            self._put_in_place()
        elif not wanted and self._tab is not None:
            self._tab.remove()
            self._tab = None

    def _put_in_place(self) -> None:
        # viser adds tabs at the end only; the order of its own list is what browsers are told.
        handles = self._group._tab_handles
        labels = [handle._label for handle in handles]
        place = next((labels.index(label) for label in self._before if label in labels), None)
        if place is not None:
            handles.insert(place, handles.pop())
            self._group._rebuild_tab_props()
