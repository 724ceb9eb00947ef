"""Light for the scene: soft from all sides and free of shadows, light enough to draw without a graphics card."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import viser


def prepare_stage(scene: "viser.SceneApi") -> None:
    """Set up direction and light of an empty scene; to be called once, before anything is drawn."""
    scene.set_up_direction("+z")
    # A photographed environment costs software renderers half of their frames and fades in for a second.
    scene.configure_environment_map(hdri=None)
    scene.configure_default_lights(enabled=True, cast_shadow=False)
    scene.add_light_hemisphere("/light/sky", sky_color=(255, 255, 255), ground_color=(150, 150, 160), intensity=1.8)
