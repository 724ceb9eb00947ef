"""Imports run one way: a module may use only what stands before it in ``ORDER``. A package counts as one entry."""

import ast
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent

FOUNDATION = """
    core.version core.errors core.geometry core.rotations
    core.phi_transforms core.robot core.phi_convention core.phi_model
    core.kinematics core.measurements
"""
FILES = """
    core.units core.input_files core.file_records core.toml_text core.toml_records core.text_table
    core.robot_builders core.urdf_masses core.urdf core.robot_files core.robot_writer
    core.measurement_columns core.point_covariance core.measurement_checks core.measurement_table
    core.measurement_writer core.campaign_files core.campaign_archive core.campaign_writer core.points_file
"""
CALIBRATION = """
    core.theodolite core.noise core.axes core.displacement core.sweep_fits
    core.motion_forms core.parameter_covariance core.arm core.function_fit core.drives core.transmission
    core.estimate core.phi_uncertainty core.arm_jacobian core.coupling
    core.walk_from_base core.joint_by_joint core.refinement_problem core.refined_curves core.refinement
    core.arc_needed core.live_sweep core.base_placement core.findings core.calibration
    core.solve_figures
"""
SESSIONS = """
    core.instruments core.by_hand core.point_lines
    core.session_robot core.session_values core.session_journal core.session_plan
    core.session_poses
    core.session_events core.suggested_plan
    core.session_entries core.session_import core.session_shots core.session_state
    core.session_conditions core.entered_shots core.session_live core.session_families core.cell_setup
    core.session_lock core.session_store core.session_checks core.session_fold core.session_reader
    core.session_timeline core.session core.session_library core.session_campaign
    core.session_archive core.import_tray
"""
RESULTS = """
    core.wording core.report core.json_values core.json_records core.robot_json
    core.axis_json core.motion_json core.calibration_json
"""
USE = """
    core.driven_robot core.subproblems core.closed_form core.pose_iteration core.pose_seeds core.inverse_kinematics
    core.calibrated_arm core.calibration_file core.pose_files core.compensation core.compensation_effect
    core.rigid_pose core.standstills core.pose_visits
    core.link_poses core.body_poses core.framed_poses core.point_places core.end_effector
    core.verification core.pose_loop core.repeatability core.verification_json
    core.robot_export core.dh_export core.gap
    core.planning core.rivals
    core.twin
"""
APP = """
    app.paths app.progress app.output app.standard_output app.summary
    app.figures app.scene app.report_page app.report_cells app.report_words app.report_tables
    app.captions app.report_scene app.report_html
    app.verification_report app.gap_tables app.gap_report app.gap_summary app.blind_report
    app.isolability_summary app.isolability_report
    app.comparison_report app.comparison_summary
    app.rigs app.ahead app.rigged_session app.shooting app.robot_runs app.typed_shots app.decisions app.solving
    app.known_so_far app.sweep_progress app.workbench app.pose_bench app.beside app.jobs
    app.callbacks app.log_file app.spots app.clicks app.words app.table_2 app.cell_view
    app.glossary app.keys app.uploads app.exports app.event_words app.measure_words app.cell_words app.solve_words
    app.review_words
    app.pose_view app.pose_words app.compensate_bench app.compensate_words app.compare_bench app.compare_words
    app.gap_bench app.gap_words app.gap_view app.panels app.verify_tabs app.gap_tabs
    app.dashboard
    app.commands app.__main__
"""
ORDER = (FOUNDATION + FILES + CALIBRATION + SESSIONS + RESULTS + USE + APP).split()

DRAWING = {"viser", "plotly", "jinja2", "matplotlib"}
TABLES = {"pandas"}


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_name(p): p for folder in ("core", "app") for p in sorted((ROOT / folder).rglob("*.py"))}
"""Every module of the product, by its full name."""


@cache
def imports(module: str) -> frozenset[str]:
    """Full names of what a module imports, anywhere in it, also inside functions: ``core.axes.fit_axis``."""
    names = set()
    for node in ast.walk(ast.parse(MODULES[module].read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module}, line {node.lineno}: a relative import, expected the full name"
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return frozenset(names)


def own_imports(module: str) -> set[str]:
    """The modules of the product that a module imports."""
    found = set()
    for name in imports(module):
        while name not in MODULES and "." in name:
            name = name.rpartition(".")[0]
        if name in MODULES:
            found.add(name)
    return found - {module}


def rank(module: str) -> int:
    """Where a module stands in the order."""
    places = [k for k, entry in enumerate(ORDER) if f"{module}.".startswith(f"{entry}.")]
    assert len(places) == 1, f"{module} has {len(places)} places in ORDER of tests/test_layers.py, expected one"
    return places[0]


def outsiders(module: str) -> set[str]:
    """The top-level names of all that a module imports."""
    return {name.split(".")[0] for name in imports(module)}


def named(*prefixes: str) -> list[str]:
    return [module for module in MODULES if any(f"{module}.".startswith(f"{prefix}.") for prefix in prefixes)]


@pytest.mark.parametrize("module", [m for m in MODULES if m not in ("core", "app")])
def test_a_module_uses_only_what_stands_before_it(module: str) -> None:
    later = sorted(name for name in own_imports(module) - {"core", "app"} if rank(name) > rank(module))
    assert not later, f"{module} imports {', '.join(later)}, which stand after it"


def test_every_entry_of_the_order_is_there() -> None:
    assert [entry for entry in ORDER if entry not in MODULES] == []
    assert len(set(ORDER)) == len(ORDER)


def test_nothing_goes_round_within_packages_either() -> None:
    TopologicalSorter({module: own_imports(module) for module in MODULES}).prepare()


def test_the_packages_themselves_import_nothing_of_the_product() -> None:
    assert own_imports("core") == own_imports("app") == own_imports("app.commands") == set()


@pytest.mark.parametrize("module", named("core"))
def test_the_core_neither_draws_nor_knows_the_app(module: str) -> None:
    assert not outsiders(module) & (DRAWING | {"app"})


@pytest.mark.parametrize("module", [m for m in named("core") if m != "core.report"])
def test_tables_are_made_in_one_place(module: str) -> None:
    assert not outsiders(module) & TABLES


@pytest.mark.parametrize("module", [m for m in named("core") if m not in named("core.twin")])
def test_the_core_knows_nothing_of_the_simulation(module: str) -> None:
    assert not [name for name in own_imports(module) if name.startswith("core.twin")]


@pytest.mark.parametrize("module", named("app.figures"))
def test_figures_know_nothing_of_the_scene(module: str) -> None:
    assert "viser" not in outsiders(module)


def test_the_core_prints_nothing() -> None:
    talkers = []
    for module in named("core"):
        tree = ast.parse(MODULES[module].read_text(encoding="utf-8"))
        calls = [node.func for node in ast.walk(tree) if isinstance(node, ast.Call)]
        talkers += [module for func in calls if isinstance(func, ast.Name) and func.id == "print"]
    assert talkers == []
