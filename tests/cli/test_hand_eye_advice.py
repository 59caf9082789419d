"""What `vision hand-eye` says of input that is wrong, and that the result is right where the advice is followed."""

# obeys: poses-read-otherwise
# obeys: paired-in-order
# obeys: views-without-pose
# obeys: lens-contradicted
# obeys: target-size-contradicted
# obeys: hand-eye-far
# obeys: view-moved
# obeys: labels-turned

from __future__ import annotations

import shlex

import numpy as np
import pytest
from cli.runs import robocal
from hand_eye_world import IMAGE, codes, corners, hand_eye, lens_file, named, off_by, poses, world
from lens_world import LENS, board_rows, write


def cell(folder, made, told=None, **how):
    """The words of a run."""
    views = corners(folder, made, **{k: v for k, v in how.items() if k in ("pixels",)})
    form = {k: v for k, v in how.items() if k in ("form", "length", "units", "heads")}
    names = how.get("names", named(made))
    place = poses(folder, made.told if told is None else told, names=names, **form)
    return [views, place, "--lens", lens_file(folder), "--image", IMAGE]


def refused(document, code):
    """The reasons with a code, of a verdict that is none."""
    assert document["verdict"]["status"] in ("refused", "not_improved"), document["verdict"]
    return [r for r in document["verdict"]["remarks"] if r["code"] == code]


def obey(words, reasons, choose=0):
    """The run once more with the option that is told."""
    option = reasons[0]["numbers"]["option"].split(", or ")[choose].replace(", and", "")
    assert option in reasons[0]["advice"]
    told, status = hand_eye(*words, *shlex.split(option))
    assert status == 0 and "poses-read-otherwise" not in codes(told), told["verdict"]
    return told


@pytest.mark.parametrize("inhand", [True, False])
def test_poses_in_the_other_direction(tmp_path, inhand):
    """Of the base in the flange; or the camera named on the wrong side: both are told, and both are right where they are said."""
    made = world(11, inhand=inhand)
    mount = ["--camera", "hand" if inhand else "fixed"]
    words = cell(tmp_path, made, np.linalg.inv(made.told))
    told, status = hand_eye(*words, *mount)
    reasons = refused(told, "poses-read-otherwise")
    assert (
        status == 3 and len(reasons) == 1 and "--inverse" in reasons[0]["advice"] and "--camera" in reasons[0]["advice"]
    )
    found = obey([*words, *mount], reasons)
    assert np.abs(off_by(found, made)).max() < 4
    other = ["--camera", "fixed" if inhand else "hand"]
    words = cell(tmp_path, made)
    told, status = hand_eye(*words, *other)
    assert status == 3
    assert np.abs(off_by(obey(words, refused(told, "poses-read-otherwise"), choose=1), made)).max() < 4


def test_the_order_of_quaternions(tmp_path):
    made = world(12)
    words = cell(tmp_path, made, form="abb", heads=("qx", "qy", "qz", "qw"))
    told, status = hand_eye(*words)
    assert status == 3
    assert np.abs(off_by(obey(words, refused(told, "poses-read-otherwise")), made)).max() < 4


def test_lengths_in_another_unit(tmp_path):
    """Millimetres without a word are read as metres: told, and right with --units."""
    made = world(13)
    words = cell(tmp_path, made, units=False)
    told, status = hand_eye(*words)
    reasons = refused(told, "poses-read-otherwise")
    assert status == 3 and reasons[0]["numbers"]["option"] == "--units mm"
    assert np.abs(off_by(obey(words, reasons), made)).max() < 4


def _flip(told):
    told[:, 0, 3] *= -1


def _swap(told):
    told[:, :2, 3] = told[:, 1::-1, 3]


def _invert(told):
    told[:, :3, :3] = np.swapaxes(told[:, :3, :3], 1, 2).copy()


@pytest.mark.parametrize(
    ("fault", "said"), [(_flip, "change the sign of x"), (_swap, "exchange x and y"), (_invert, "invert the turns")]
)
def test_columns_of_poses_with_another_sign_or_in_another_order(tmp_path, fault, said):
    """No option says it: the file is put right, and then the camera is located."""
    made = world(13)
    told = made.told.copy()
    fault(told)
    found, status = hand_eye(*cell(tmp_path, made, told))
    (reason,) = refused(found, "poses-read-otherwise")
    assert status == 3 and said in reason["advice"]
    fault(told)
    found, status = hand_eye(*cell(tmp_path, made, told))
    assert status == 0 and "poses-read-otherwise" not in codes(found)


def test_angles_in_another_unit(tmp_path):
    """Rotation vectors in rad read in deg; degrees read in rad are refused while they are read."""
    made = world(14)
    words = [*cell(tmp_path, made, form="ur", length=1.0, units=False), "--maker", "ur"]
    told, status = hand_eye(*words, "--units", "m,deg")
    assert status == 3
    assert "--units rad" in refused(told, "poses-read-otherwise")[0]["advice"]
    assert hand_eye(*words, "--units", "m,rad")[1] == 0
    words = [*cell(tmp_path, made, form="kuka", units=False), "--maker", "kuka"]
    ran = robocal("vision", "hand-eye", *words, "--units", "mm,rad")
    assert ran.status == 2 and "whole turn" in ran.err and "--units mm,deg" in ran.err
    assert hand_eye(*words)[1] == 0


def test_angles_of_another_maker(tmp_path):
    made = world(15)
    words = cell(tmp_path, made, form="fanuc")
    ran = robocal("vision", "hand-eye", *words)
    assert ran.status == 2 and "several meanings" in ran.err and "--maker" in ran.err
    told, status = hand_eye(*words, "--euler", "ZYX")
    assert status == 3
    assert np.abs(off_by(obey(words, refused(told, "poses-read-otherwise")), made)).max() < 4


def test_images_out_of_step_by_one(tmp_path):
    """Without names views are paired in order, and said to be; out of step they are refused; names put it right."""
    made = world(16, count=18)
    words = cell(tmp_path, made, names=None)
    told, status = hand_eye(*words)
    assert status == 0 and "paired-in-order" in codes(told)
    moved = np.roll(made.told, 1, axis=0)
    told, status = hand_eye(*cell(tmp_path, made, moved, names=None))
    assert status == 3 and codes(told) & {"poses-read-otherwise", "views-shifted"}, told["verdict"]
    told, status = hand_eye(*cell(tmp_path, made, moved, names=list(np.roll(named(made), 1))))
    assert status == 0 and "paired-in-order" not in codes(told)
    pairs = {c["name"]: c["values"] for c in told["pairs"]["columns"]}
    assert pairs["view"][0] == "v1" and pairs["pose"][0].endswith("v1.png")


def test_views_without_a_pose(tmp_path):
    made = world(17, count=14)
    views, place, *more = cell(tmp_path, made)
    fewer = poses(tmp_path, made.told[2:], names=named(made)[2:], name="fewer.csv")
    told, status = hand_eye(views, fewer, *more)
    (said,) = [r for r in told["remarks"] if r["code"] == "views-without-pose"]
    assert status == 0 and said["numbers"]["views"] == ["v1", "v2"]
    assert "views-without-pose" not in codes(hand_eye(views, place, *more)[0])
    unnamed = poses(tmp_path, made.told[2:], name="unnamed.csv")
    ran = robocal("vision", "hand-eye", views, unnamed, *more)
    assert ran.status == 2 and "14 views and 12 poses" in ran.err and "image" in ran.err


@pytest.mark.parametrize("axis", [(0, 0, 1), (1, 0, 0)])
def test_turns_about_one_axis_are_refused_with_the_poses_to_add(tmp_path, axis):
    made = world(18, count=12, inhand=False, axis=axis)
    told, status = hand_eye(*cell(tmp_path, made), "--camera", "fixed")
    assert status == 3 and refused(told, "one-axis"), told["verdict"]
    columns = {c["name"]: np.array(c["values"]) for c in told["further"]["columns"][1:]}
    assert len(columns["x"]) == 3 and columns["turn"].max() > 20
    assert (np.diff([told["sure"], *columns["sure"]]) < 0).all()


def test_little_turns_and_few_views_are_refused(tmp_path):
    told, status = hand_eye(*cell(tmp_path, world(19, tilt=0.02)))
    assert status == 3 and refused(told, "little-turn")
    made = world(20, count=2)
    ran = robocal("vision", "hand-eye", *cell(tmp_path, made))
    assert ran.status == 2 and "3 at least" in ran.err


def test_a_lens_of_another_focus(tmp_path):
    """The lens is contradicted, and the advice, its own lens, leaves nothing of that."""
    made = world(21, count=20)
    views, place, *_ = cell(tmp_path, made)
    off = lens_file(tmp_path, LENS | {"fx": 1075.0, "fy": 1080.0, "cx": 680.0}, "off.yaml")
    told, status = hand_eye(views, place, "--lens", off, "--image", IMAGE)
    assert status == 3
    assert any("--free-lens" in r["advice"] for r in told["verdict"]["remarks"])
    told, _ = hand_eye(views, place, "--lens", off, "--image", IMAGE, "--free-lens")
    assert "lens-contradicted" in codes(told)
    told, status = hand_eye(views, place, "--lens", lens_file(tmp_path), "--image", IMAGE, "--free-lens")
    assert status == 0 and "lens-contradicted" not in codes(told)


def test_a_target_whose_poses_are_in_another_unit(tmp_path):
    """Poses of a target in mm without a unit: the option of the target's poses is told, and obeyed it locates."""
    made = world(7, count=16)
    words = [poses(tmp_path, made.seen, name="marker.csv", units=False), poses(tmp_path, made.told)]
    told, status = hand_eye(*words)
    assert status == 3 and any("--target-units mm" in r["advice"] for r in told["verdict"]["remarks"])
    assert hand_eye(*words, "--target-units", "mm")[1] == 0


def test_times_of_views_keep_their_fractions(tmp_path):
    """Views named by times without an end of a file are not cut at the point."""
    made = world(7, count=16)
    when = [f"{1000 + 0.5 * i:.2f}" for i in range(16)]
    views = write(
        tmp_path / "timed.csv",
        [
            row | {"view": when[int(row["view"][1:]) - 1]}
            for row in board_rows(made.pixels, 0.1, np.random.default_rng(2))
        ],
    )
    lines = (tmp_path / "poses.csv").read_text().splitlines() if poses(tmp_path, made.told) else []
    (tmp_path / "t.csv").write_text("\n".join(",".join(w) for w in zip(["time [s]", *when], lines, strict=True)) + "\n")
    words = (views, tmp_path / "t.csv", "--lens", lens_file(tmp_path), "--image", IMAGE, "--pair", "time")
    told, status = hand_eye(*words)
    assert status == 0 and told["error"]["rms"] < 1


def test_a_prior_of_the_lens_that_pulls_the_camera(tmp_path):
    """A lens found half as long again as its file says is pulled by its prior: not located, until the file has what was found."""
    made = world(8, count=20, tilt=0.4)
    views, place, *_ = cell(tmp_path, made)
    off, out = lens_file(tmp_path, LENS | {"fx": 1575.0, "fy": 1582.5}, "off.yaml"), tmp_path / "out"
    words = (views, place, "--image", IMAGE, "--free-lens", "--lens")
    told, status = hand_eye(*words, off, "-o", out)
    assert status == 3
    (said,) = [r for r in told["verdict"]["remarks"] if r["code"] == "lens-contradicted"]
    assert "lens.yaml" in said["advice"]
    told, _ = hand_eye(*words, out / "lens.yaml", "-o", out, "--force")  # what is found is nearer
    told, status = hand_eye(*words, out / "lens.yaml")
    assert status == 0 and np.abs(off_by(told, made)).max() < 4


def test_a_few_views_that_are_labelled_from_the_other_end(tmp_path):
    """They are gross, so the camera is right; that it is half a turn is told, and obeyed nothing is gross any more."""
    made = world(5, count=14)
    turned = np.array(made.pixels)
    turned[[3, 7]] = turned[[3, 7]][:, ::-1]
    _, place, *_ = cell(tmp_path, made)
    words = (
        corners(tmp_path, made, name="half.csv", pixels=turned),
        place,
        "--lens",
        lens_file(tmp_path),
        "--image",
        IMAGE,
    )
    told, status = hand_eye(*words)
    (said,) = [r for r in told["remarks"] if r["code"] == "labels-turned"]
    assert status == 0 and said["numbers"]["views"] == ["v4", "v8"] and "--undo-half-turns" in said["advice"]
    told, status = hand_eye(*words, "--undo-half-turns")
    assert status == 0 and not {"labels-turned", "outliers"} & codes(told)


def test_mirrored_images_are_named_where_the_lens_is_free(tmp_path):
    made = world(13)
    _, place, *_ = cell(tmp_path, made)
    mirrored = made.pixels * [-1, 1] + [int(IMAGE.split("x")[0]) - 1, 0]
    for pixels, right in ((mirrored, False), (made.pixels, True)):
        views = corners(tmp_path, made, pixels=pixels)
        told, status = hand_eye(views, place, "--lens", lens_file(tmp_path), "--image", IMAGE, "--free-lens")
        assert (status == 0) is right and ("image-mirrored" in codes(told)) is not right, told["verdict"]


@pytest.mark.parametrize(("seed", "count", "some"), [(5, 30, [3, 7, 11]), (6, 20, [0, 1, 2])])
def test_views_from_the_other_end_are_the_cause_of_what_they_leave_behind(tmp_path, seed, count, some):
    """Not that more configurations are wanted, nor that the board moved."""
    made = world(seed, count=count)
    turned = np.array(made.pixels)
    turned[some] = turned[some][:, ::-1]
    _, place, *_ = cell(tmp_path, made)
    views = corners(tmp_path, made, name="half.csv", pixels=turned)
    words = (views, place, "--lens", lens_file(tmp_path), "--image", IMAGE)
    told, status = hand_eye(*words)
    assert status == 3 and [r["code"] for r in told["verdict"]["remarks"]] == ["labels-turned"], told["verdict"]
    assert hand_eye(*words, "--undo-half-turns")[1] == 0


def test_times_of_poses_in_another_unit_than_their_head_says(tmp_path):
    """Times in s under a head of ms agree with those of views read in ms; but no hand is as fast."""
    made = world(7, count=16)
    when = [f"{1000 + 0.5 * i:.2f}" for i in range(16)]
    rows = board_rows(made.pixels, 0.1, np.random.default_rng(2))
    views = write(tmp_path / "timed.csv", [row | {"view": when[int(row["view"][1:]) - 1]} for row in rows])
    poses(tmp_path, made.told)
    lines = zip(["time [ms]", *when], (tmp_path / "poses.csv").read_text().splitlines(), strict=True)
    (tmp_path / "t.csv").write_text("\n".join(",".join(w) for w in lines) + "\n")
    words = (views, tmp_path / "t.csv", "--lens", lens_file(tmp_path), "--image", IMAGE, "--pair", "time")
    ran = robocal("vision", "hand-eye", *map(str, words))
    assert ran.status == 2 and "no hand is as fast" in ran.err and "time [s]" in ran.err


def test_a_lens_stays_within_what_its_file_says(tmp_path):
    """Beside --free-lens: a centre known to a hundredth of a pixel stays, what the file says nothing of is found, and the camera is no
    farther off than without the file."""
    made = world(6, count=18)
    views, place, *_ = cell(tmp_path, made)
    given = lens_file(tmp_path, LENS | {"fx": 1053.0, "k1": -0.2}, "known.yaml")
    with open(given, "a") as stream:
        stream.write("sigma: {fx: 3.0, fy: 3.0, cx: 0.01, cy: 0.01}\n")
    told, status = hand_eye(views, place, "--lens", given, "--image", IMAGE, "--free-lens")
    assert status == 0 and np.abs(off_by(told, made)).max() < 4
    lens = {c["name"]: c["values"] for c in told["lens"]["columns"]}
    found, sigma = (dict(zip(lens["name"], lens[k], strict=True)) for k in ("found", "sigma"))
    assert abs(found["cx"] - LENS["cx"]) < 0.04 and abs(found["cy"] - LENS["cy"]) < 0.04
    assert abs(found["k1"] - LENS["k1"]) < 4 * sigma["k1"] < 0.02
    off = {}
    for name, more in (("with", ("--lens", given)), ("without", ())):
        camera = np.array(hand_eye(views, place, *more, "--image", IMAGE, "--free-lens")[0]["frames"][0]["matrix"])
        off[name] = np.linalg.norm(camera[:3, 3] - 1e3 * made.camera[:3, 3])
    assert off["with"] < 1.1 * off["without"]


@pytest.mark.parametrize(("inhand", "factor"), [(True, 0.97), (False, 1.03), (True, 0.99)])
def test_a_target_of_another_size(tmp_path, inhand, factor):
    """A board stated too large by a percent or three puts the camera off by a centimetre; its own size leaves nothing of that."""
    made, camera = world(7, count=20, inhand=inhand), "hand" if inhand else "fixed"
    words = [*cell(tmp_path, made), "--camera", camera]
    rows = board_rows(made.pixels, 0.1, np.random.default_rng(2))
    stated = [{k: factor * v if k.startswith("point") else v for k, v in row.items()} for row in rows]
    told, status = hand_eye(write(tmp_path / "stated.csv", stated), *words[1:])
    assert status == 3
    (said,) = [r for r in told["verdict"]["remarks"] if r["code"] == "target-size-contradicted"]
    assert "--square" in said["advice"]
    assert abs(said["numbers"]["factor"] * factor - 1) < 0.004
    told, status = hand_eye(*words)
    assert status == 0 and "target-size-contradicted" not in codes(told)


def test_a_robot_that_is_far_off(tmp_path):
    """Poses off by a centimetre are told against what is normal."""
    made = world(22, count=20, inhand=False, error=8.0)
    told, _ = hand_eye(*cell(tmp_path, made), "--camera", "fixed")
    assert "hand-eye-far" in codes(told) or told["verdict"]["status"] != "located"
    assert told["error"]["rms"] > 3 * told["normal"]
    told, status = hand_eye(*cell(tmp_path, world(22, count=20, inhand=False)), "--camera", "fixed")
    assert status == 0 and "hand-eye-far" not in codes(told)


def test_a_board_that_moved_half_way(tmp_path):
    made = world(23, count=24, inhand=False)
    moved = np.array(made.told)
    moved[14:, :3, 3] += [0.006, 0.004, 0.0]
    told, status = hand_eye(*cell(tmp_path, made, moved), "--camera", "fixed")
    assert status == 3
    assert refused(told, "view-moved"), told["verdict"]
    words = cell(tmp_path, made, moved)
    told, status = hand_eye(*words, "--camera", "fixed", "--exclude", ",".join(f"v{i}" for i in range(15, 25)))
    assert status == 0, told["verdict"]


def test_errors_of_words(tmp_path):
    made = world(24, count=6)
    views, place, *more = cell(tmp_path, made)
    for words, told in (
        ((views, place, "--image", IMAGE), "--lens"),
        ((views, place, *more, "--maker", "ur"), "orientation"),
        ((views, place, *more, "--euler", "ABC"), "three axes"),
        ((views, place, *more, "--units", "kg"), "units of a pose"),
        ((views, place, *more, "--pair", "time"), "no times"),
        ((views, views, *more), "position"),
        ((views, str(tmp_path / "none"), *more), "none"),
    ):
        ran = robocal("vision", "hand-eye", *words)
        assert ran.status == 2 and told in ran.err, (words, ran.err)


def test_a_board_labelled_from_its_other_end(tmp_path):
    made = world(25, count=14)
    pixels = np.array(made.pixels)
    pixels[[2, 5, 9, 11]] = pixels[[2, 5, 9, 11]][:, ::-1]
    words = cell(tmp_path, made, pixels=pixels)
    told, status = hand_eye(*words)
    (reason,) = refused(told, "labels-turned")
    assert status == 3 and reason["numbers"]["count"] == 4 and "--undo-half-turns" in reason["advice"]
    told, status = hand_eye(*words, "--undo-half-turns")
    assert status == 0 and np.abs(off_by(told, made)).max() < 4, told["verdict"]


def test_images_that_are_mirrored_or_exchanged(tmp_path):
    """Said alone: nothing is doubted of the lens or of the robot."""
    made = world(26, count=14)
    for code, pixels in (
        ("axes-exchanged", made.pixels[..., ::-1]),
        ("image-mirrored", [1279.0, 0] - made.pixels * [1, -1]),
    ):
        told, status = hand_eye(*cell(tmp_path, made, pixels=np.array(pixels)))
        assert status == 3 and {r["code"] for r in told["verdict"]["remarks"]} == {code}, told["verdict"]
