"""Advice is obeyed as it is printed, and what comes out is better."""

from __future__ import annotations

import os
from pathlib import Path

import advice_arms  # noqa: F401 - fills the table
import advice_cables  # noqa: F401
import advice_cells  # noqa: F401
import advice_compared  # noqa: F401
import advice_files  # noqa: F401
import advice_kinds  # noqa: F401
import advice_more  # noqa: F401
import advice_statics  # noqa: F401
import advice_uses  # noqa: F401
import advice_verbs  # noqa: F401
import pytest
from advice import OBEYED, advised, is_better, spoken

QUICK = (
    "lengths-exchanged",
    "wrong-unit",
    "robot-size",
    "csv-title",
    "copied",
    "scale-of-drums",
    "groups-help",
    "below-stated-noise",
)
# Obeyed by a test of their own, above which a comment says so: `# obeys: CODE`.
OTHER = {
    "carriages-not-read": "cli/test_cable_kinds.py",
    "points-too-few": "session/test_measured_points.py",
    "points-apart": "session/test_measured_points.py",
    "points-without-places": "session/test_measured_points.py",
    "inertia-assumed": "files/test_mjcf.py",
    "currents-exchanged": "cli/test_cable_winch_columns.py",
    "current-turned": "cli/test_cable_winch_columns.py",
    "current-unlike": "cli/test_cable_winch_columns.py",
    "currents-shifted": "cli/test_cable_winch_columns.py",
    "current-row": "cli/test_cable_winch_columns.py",
    "currents-unbalanced": "cli/test_cable_winch_columns.py",
    "winch-gain": "cli/test_cable_winch_columns.py",
    "loads-unlike": "cli/test_cable_loads_wrong.py",
    "loads-copied": "cli/test_cable_loads_wrong.py",
    "loads-unexplained": "cli/test_cable_loads_wrong.py",
    "loads-row": "cli/test_cable_loads_wrong.py",
    "loads-other": "cli/test_cable_loads_wrong.py",
    "cable-hangs-slack": "cli/test_cable_loads_wrong.py",
    "tensions-beyond": "cli/test_cable_loads_wrong.py",
    "load-not-above": "cli/test_cable_straightness.py",
    "negative-number": "session/test_joint_torques.py",
    "friction-unseen": "session/test_joint_torques.py",
    "torques-left": "session/test_joint_torques.py",
    "drive-outlier": "session/test_drive_group.py",
    "drive-window-flattens": "session/test_drive_readings.py",
    "drive-weight": "session/test_drive_readings.py",
    "drive-electrical": "session/test_drive_readings.py",
    "drive-other-sign": "session/test_drive_readings.py",
    "drive-one-direction": "session/test_drive_logs.py",
    "drive-under-turn": "session/test_drive_logs.py",
    "drive-orders-unseen": "session/test_drive_logs.py",
    "drive-other-reading": "session/test_drive_logs.py",
    "drive-explains-little": "session/test_drive_logs.py",
    "drive-speed-hides": "session/test_drive_logs.py",
    "drive-gear": "session/test_drive_logs.py",
    "drive-slots-unlike": "session/test_drive_logs.py",
    "drive-other-motor": "session/test_drive_logs.py",
    "drive-other-zero": "session/test_drive_logs.py",
    "drive-flag": "session/test_drive_logs.py",
    "drive-escaped": "session/test_drive_logs.py",
    "drive-table-lost": "session/test_drive_logs.py",
    "drive-at-limit": "session/test_drive_traps.py",
    "drive-pace": "session/test_drive_traps.py",
    "drive-effort-size": "session/test_drive_wrong.py",
    "drive-unproven": "session/test_drive_wrong.py",
    "drive-one-unlike": "session/test_drive_wrong.py",
    "drive-lag-far": "session/test_drive_wrong.py",
    "drive-arc-unread": "session/test_drive_wrong.py",
    "stretch-beyond": "cli/test_cable_loads_wrong.py",
    "cable-too-light": "cli/test_cable_loads_wrong.py",
    "loads-scatter": "cli/test_cable_loads_wrong.py",
    "span-unlike": "cli/test_cable_loads_wrong.py",
    "torque-size": "session/test_torque_units.py",
    "torque-speed": "session/test_torque_units.py",
    "drive-other-gain": "session/test_drive_traps.py",
    "band-blind": "unit/test_total.py",
    "camera-drift": "prove/test_camera_drift.py",
    "clocks-apart": "session/test_hand_eye_unknowns.py",
    "one-stands-still": "cli/test_hand_eye_pairs.py",
    "prior-contradicted": "prove/test_cable_camera.py",
    "board-turns": "cli/test_detect_sheets.py",
    "board-other": "cli/test_detect_sheets.py",
    "frames-loose": "session/test_pose_pairs.py",
    "views-flipped": "session/test_pose_pairs.py",
    "markers-off-sheet": "cli/test_detect_sheets.py",
    "baselines-apart": "prove/test_baselines.py",
    "no-change-found": "session/test_own_machines.py",
    "frame-fixed": "prove/test_frames_alone.py",
    "frames-located": "prove/test_frames_alone.py",
    "plan-too-coarse": "cli/test_vision_require.py",
    "lens-focal-open": "cli/test_vision_intrinsics.py",
    "lens-found-folds": "cli/test_vision_intrinsics.py",
    "lens-folds-outside": "cli/test_vision_intrinsics.py",
    "lens-leaves": "cli/test_vision_intrinsics.py",
    "target-size-odd": "cli/test_vision_intrinsics.py",
    "lens-misses": "cli/test_vision_intrinsics.py",
    "lens-off-centre": "cli/test_vision_intrinsics.py",
    "lens-overfitted": "cli/test_vision_intrinsics.py",
    "little-turn": "prove/test_frames_alone.py",
    "marker-has-two-poses": "cli/test_vision_detect.py",
    "corners-outside": "cli/test_vision_map.py",
    "lens-prior-contradicted": "cli/test_vision_map.py",
    "map-aside": "cli/test_vision_map.py",
    "map-misses": "cli/test_vision_map.py",
    "markers-never-whole": "cli/test_vision_map.py",
    "markers-open": "cli/test_vision_map.py",
    "views-from-one-place": "cli/test_vision_map.py",
    "map-overfitted": "cli/test_vision_map.py",
    "map-unproven": "cli/test_vision_map.py",
    "marker-size-contradicted": "cli/test_vision_map.py",
    "map-prior-scaled": "session/test_known_markers.py",
    "marker-sizes-scatter": "cli/test_vision_map.py",
    "map-sizes-unlike": "session/test_map_places.py",
    "map-of-other-size": "session/test_map_places.py",
    "marker-moved": "cli/test_vision_map.py",
    "markers-in-few-views": "cli/test_vision_map.py",
    "map-covariance-missing": "files/test_maps.py",
    "map-corners-excluded": "session/test_map_places.py",
    "map-marker-moved": "session/test_map_places.py",
    "map-unlike-views": "session/test_map_places.py",
    "maps-apart": "session/test_map_compare.py",
    "maps-of-other-markers": "session/test_map_compare.py",
    "maps-scaled": "session/test_map_compare.py",
    "marker-moved-since": "session/test_known_markers.py",
    "marker-moved-between": "session/test_map_compare.py",
    "map-without-sigma": "session/test_map_places.py",
    "lens-without-sigma": "session/test_map_places.py",
    "markers-not-in-map": "session/test_map_places.py",
    "view-has-two-poses": "session/test_map_places.py",
    "view-without-map": "session/test_map_places.py",
    "moved-or-bent": "prove/test_regions_of_joints.py",
    "nothing-measured-there": "unit/test_identify.py",
    "one-axis": "prove/test_frames_alone.py",
    "segments": "prove/test_several_changes.py",
    "urdf-cannot-hold": "cli/test_urdf_runs.py",
    "urdf-lacks": "cli/test_urdf_runs.py",
    "one-change-explains": "session/test_naming_causes.py",
    "rows-of-another-robot": "session/test_naming_causes.py",
    "rows-of-two-robots": "session/test_naming_causes.py",
    "rows-off": "session/test_naming_causes.py",
    "axes-exchanged": "diagnose/test_camera_views.py",
    "image-mirrored": "diagnose/test_camera_views.py",
    "v-upward": "prove/test_cable_camera_mistakes.py",
    "lens-factor": "diagnose/test_camera_views.py",
    "lens-factor-doubted": "diagnose/test_camera_views.py",
    "target-turned": "diagnose/test_camera_views.py",
    "views-shifted": "diagnose/test_camera_views.py",
    "print-beside-lengths": "diagnose/test_print_size.py",
    "view-alone": "diagnose/test_views.py",
    "view-elsewhere": "diagnose/test_views.py",
    "view-exchanged": "diagnose/test_views.py",
    "views-exchanged": "diagnose/test_views.py",
}
OTHER |= dict.fromkeys(
    ("hand-eye-few-views", "hand-eye-not-explained", "hand-eye-not-converged"), "cli/test_hand_eye_wrong_rows.py"
)
OTHER |= dict.fromkeys(("frame-moved", "frame-elsewhere", "phantom-mixed"), "diagnose/test_frame_steps.py")
OTHER |= dict.fromkeys(("view-of-another", "corners-reordered", "target-unit"), "prove/test_cable_camera_mistakes.py")
OTHER |= dict.fromkeys(
    ("phantom-exchanged", "phantom-unit", "phantom-mirrored", "phantom-displaced", "pixel-size"),
    "diagnose/test_phantom.py",
)
OTHER |= dict.fromkeys(
    "labels-turned poses-read-otherwise paired-in-order views-without-pose lens-contradicted hand-eye-far view-moved "
    "target-size-contradicted".split(),
    "cli/test_hand_eye_advice.py",
)
OTHER |= dict.fromkeys(
    "views-out-of-step readings-of-another marker-twice markers-exchanged sights-aside".split(),
    "cli/test_hand_eye_names.py",
)
OTHER |= dict.fromkeys(
    "rig-drives rig-encoder rig-exchanged rig-infeasible rig-lengths-disagree rig-limits-left rig-reversed rig-slack rig-stopped "
    "rig-weight".split(),
    "cli/test_wrong_rigs.py",
)
OTHER |= {"rig-contradicted": "session/test_hand_eye_rig.py"}
OTHER |= dict.fromkeys(
    "image-turned video-ends-early image-sizes-differ no-target-found no-marker-in-view one-marker-in-view other-dictionary dictionary-found "
    "dictionary-unsure board-found size-not-stated two-of-one-number mirrored-image markers-apart markers-at-border image-overexposed "
    "motion-blur image-blurred edges-alone lens-bends marker-dropped image-hardly-covered".split(),
    "cli/test_vision_advice.py",
)


def _cost(at: int, code: str) -> list[pytest.MarkDecorator]:
    """A few in every run, a third of the others in the slow one, all with ROBOCAL_FULL=1."""
    if code in QUICK:
        return []
    return [
        pytest.mark.slow,
        pytest.mark.skipif(at % 3 > 0 and not os.environ.get("ROBOCAL_FULL"), reason="ROBOCAL_FULL=1"),
    ]


@pytest.mark.parametrize("code", [pytest.param(c, marks=_cost(i, c)) for i, c in enumerate(OBEYED)])
def test_obeyed_it_ends_better(code, tmp_path, monkeypatch):
    monkeypatch.setenv("COLUMNS", "300")  # a cell that is broken into lines is no sentence
    first, then = OBEYED[code](tmp_path)
    assert spoken(first, code), first.said
    assert is_better(first, then, code), (first.status, then.status, then.said)


def test_every_advice_is_obeyed():
    """Every code with advice is in one list, and a list holds no other."""
    lists = [set(OBEYED), set(OTHER)]
    assert sum(map(len, lists)) == len(set().union(*lists))
    assert advised() == set().union(*lists), advised() ^ set().union(*lists)
    for code, place in OTHER.items():
        assert f"# obeys: {code}\n" in (Path(__file__).parents[1] / place).read_text(), (code, place)


def test_a_better_end_can_fail():
    """Advice that is not followed ends no better."""
    from cli.runs import Ran

    same = Ran(3, "all configurations are equal: this shows repeatability, not geometry", "")
    assert spoken(same, "one-place") and not is_better(same, same, "one-place")
    assert is_better(same, Ran(0, "", ""), "one-place") and not is_better(same, Ran(2, "", ""), "one-place")
