"""A camera's lens in a data file: numbers or a file, as a prior that its numbers share, of images of the lens' own size."""

from __future__ import annotations

import json

import numpy as np
import pytest
from files.data_samples import write_dataset
from files.kind_samples import ARM, put, texts

from robocal.diagnose.check_registry import Context
from robocal.diagnose.lens_fold import lens_reach
from robocal.errors import FormatError, InputError, ModelError
from robocal.estimate.priors import shared_root
from robocal.files.dataset import read_dataset, read_datasets
from robocal.files.lens import lens_text
from robocal.measure.base import problem
from robocal.measure.pixels import LENS_FILE
from robocal.vision.camera import SYMBOLS, image_of
from robocal.vision.lenses import Lens

NUMBERS = [1406.0, 1406.2, 643.0, 478.0, 0.004, 0, 0, 0, 0]
KNOWN = ("fx", "fy", "cx", "k1")
SPREAD = np.diag([5.0, 5.0, 3.0, 4e-3])
SPREAD = SPREAD @ np.array([[1, 0.99, 0, 0.2], [0.99, 1, 0, 0.2], [0, 0, 1, 0], [0.2, 0.2, 0, 1]]) @ SPREAD
LENS = Lens.of("brown", NUMBERS, (1280, 960), KNOWN, SPREAD)


def described(camera, more=""):
    data, table = texts("pixels")
    lines = [f"camera: {camera}" if line.startswith("camera:") else line for line in data.splitlines()]
    return "\n".join([*lines, more]) + "\n", table


def read(tmp_path, camera, more="", lens=LENS, form="robocal"):
    if lens is not None:
        (tmp_path / "lens.yaml").write_text(lens_text(lens, form, "left"), encoding="utf-8")
    return read_dataset(put(tmp_path, *described(camera, more)), ARM)


def options(reading):
    return options_of(reading.dataset)


def test_the_lens_of_a_file_is_a_prior_that_its_numbers_share(tmp_path):
    reading = read(tmp_path, "{name: left, file: lens.yaml}", "image: [1280, 960]")
    o = options(reading)
    assert o["intrinsics"] == LENS.numbers and o["free"] == KNOWN and o["size"] == (1280, 960)
    assert [f.file.name for f in reading.files] == ["data.yaml", "table.csv", "lens.yaml"]
    p = problem(ARM, reading.dataset)
    names = [f"left.{s}" for s in KNOWN]
    assert set(names) <= set(p.free) and not {f"left.{s}" for s in SYMBOLS} - set(names) & set(p.free)
    root = shared_root(p.table, names)
    np.testing.assert_allclose(root.T @ root, np.linalg.inv(SPREAD), rtol=1e-9)
    assert p.table["left.fx"].prior == pytest.approx(5) and p.table["left.k2"].prior is None
    # It counts in what is solved: with and without it, normal equations differ by its information.
    bare = problem(
        ARM,
        read(
            tmp_path, f"{{name: left, file: lens.yaml, free: [{', '.join(KNOWN)}]}}", lens=Lens.of("brown", NUMBERS)
        ).dataset,
    )
    at = [p.free.index(n) for n in names]
    more = p.normal(p.start).a[0] - bare.normal(bare.start).a[0]
    lower = np.tril(np.linalg.inv(SPREAD))
    np.testing.assert_allclose(np.tril(more[np.ix_(at, at)]), lower, atol=1e-6 * np.abs(lower).max())


def test_what_free_says_of_it(tmp_path):
    """Held only where that is said; of some that are free, what the prior says of them alone."""
    assert options(read(tmp_path, "{name: left, file: lens.yaml, free: false}"))["free"] == ()
    assert options(read(tmp_path, "{name: left, file: lens.yaml, free: true}"))["free"] == SYMBOLS
    reading = read(tmp_path, "{name: left, file: lens.yaml, free: [fx, fy, k2]}")
    assert options(reading)["free"] == ("fx", "fy", "k2")
    p = problem(ARM, reading.dataset)
    root = shared_root(p.table, ["left.fx", "left.fy", "left.k2"])
    np.testing.assert_allclose((root.T @ root)[:2, :2], np.linalg.inv(SPREAD[:2, :2]), rtol=1e-9)
    assert not root[2].any()
    # A file that states no sigma says a number as a data file does.
    for form in ("opencv", "ros", "kalibr"):
        o = options(read(tmp_path, "{name: left, file: lens.yaml}", form=form))
        assert o["free"] == () and "known" not in o and o["intrinsics"] == LENS.numbers


def test_numbers_with_a_sigma_need_no_file(tmp_path):
    camera = (
        "{name: left, fx: 900, fy: 900, cx: 320, cy: 240, sigma: {fx: 2, k1: 0.01}, correlation: [[1, 0.5], [0.5, 1]]}"
    )
    o = options(read(tmp_path, camera, lens=None))
    assert o["free"] == ("fx", "k1") and np.allclose(o["covariance"], [[4.0, 0.01], [0.01, 1e-4]])


@pytest.mark.parametrize("model", ["brown", "rational", "fisheye"])
def test_every_model_is_written_and_read_back(tmp_path, model):
    count = {"brown": 9, "rational": 12, "fisheye": 8}[model]
    numbers = [800.25, 801, 320.5, 240, *np.linspace(-0.02, 0.03, count - 4)]
    lens = Lens.of(model, numbers, (640, 480), KNOWN, SPREAD)
    data = read(tmp_path, "{name: left, file: lens.yaml}", "image: [640, 480]", lens).dataset
    (there := tmp_path / "there").mkdir()
    write_dataset(data, ARM, there / "data.yaml")
    o, back = (options(r) for r in (read_dataset(p / "data.yaml", ARM) for p in (tmp_path, there)))
    np.testing.assert_allclose(back.pop("intrinsics"), o.pop("intrinsics"), rtol=1e-14)
    np.testing.assert_allclose(back.pop("covariance"), o.pop("covariance"), rtol=1e-14)
    assert o.pop(LENS_FILE).name == "lens.yaml"  # what is written has the numbers themselves
    assert back == o


def test_images_of_another_size(tmp_path):
    """The same shape: scaling is offered, and helps where it is obeyed; another shape is refused."""
    with pytest.raises(FormatError, match="another size") as error:
        read(tmp_path, "{name: left, file: lens.yaml}", "image: [640, 480]")
    assert "`scale: 0.5` beside `file`" in error.value.expected and error.value.key == "camera.file"
    o = options(read(tmp_path, "{name: left, file: lens.yaml, scale: 0.5}", "image: [640, 480]"))
    np.testing.assert_allclose(o["intrinsics"][:4], [703, 703.1, 643.5 / 2 - 0.5, 478.5 / 2 - 0.5])
    np.testing.assert_allclose(o["covariance"][0][0], 6.25)
    with pytest.raises(FormatError, match="another size") as error:
        read(tmp_path, "{name: left, file: lens.yaml, scale: 0.25}", "image: [640, 480]")
    assert error.value.key == "camera.scale"
    with pytest.raises(FormatError, match="another shape"):
        read(tmp_path, "{name: left, file: lens.yaml}", "image: [1280, 720]")
    # As whole pixels round it.
    full = Lens.of("brown", NUMBERS, (1920, 1080))
    with pytest.raises(FormatError, match=r"another size.*scale: 0\.7114583"):
        read(tmp_path, "{name: left, file: lens.yaml}", "image: [1366, 768]", full)
    assert options(read(tmp_path, "{name: left, file: lens.yaml, scale: 0.7114583}", "image: [1366, 768]", full))[
        "size"
    ] == (1366, 768)


def test_a_table_of_detect_knows_the_size_of_its_images(tmp_path):
    beside = tmp_path / "table.json"
    beside.write_text(json.dumps({"robocal": 2, "image": [640, 480], "views": []}), encoding="utf-8")
    with pytest.raises(FormatError, match="another size"):
        read(tmp_path, "{name: left, file: lens.yaml}")
    assert options(read(tmp_path, "{name: left, file: lens.yaml}", "image: [1280, 960]"))["size"] == (1280, 960)
    for other in ('{"image": [640, 480]}', "{", "[]", '{"robocal": 2, "views": [], "image": [640]}'):
        beside.write_text(other, encoding="utf-8")
        assert "size" not in options(read(tmp_path, "{name: left, file: lens.yaml}"))


def test_a_camchain_has_several(tmp_path):
    one = lens_text(LENS, "kalibr").replace("cam0", "left")
    other = lens_text(Lens.of("fisheye", [400, 400, 640, 480, 0, 0, 0, 0], (1280, 960)), "kalibr").replace(
        "cam0", "right"
    )
    (tmp_path / "chain.yaml").write_text(one + other, encoding="utf-8")
    assert len(options(read(tmp_path, "{name: right, file: chain.yaml}"))["intrinsics"]) == 8
    with pytest.raises(FormatError, match="several cameras"):
        read(tmp_path, "{name: middle, file: chain.yaml}")


@pytest.mark.parametrize(
    ("camera", "more", "key", "words"),
    [
        ("{name: left, file: lens.yaml, fx: 900}", "", "camera.fx", "the lens is in the file"),
        ("{name: left, file: lens.yaml, model: fisheye}", "", "camera.model", "the lens is in the file"),
        ("{name: left, file: lens.yaml, sigma: {fx: 2}}", "", "camera.sigma", "the lens is in the file"),
        ("{name: left, file: lenss.yaml}", "", None, "no such file"),
        ("{name: left, file: table.csv}", "", None, "not a mapping|not valid YAML"),
        ("{name: left, file: data.yaml}", "", "kind", "this is no lens"),
        ("{fx: 1, fy: 1, cx: 0, cy: 0, scale: 0.5}", "", "camera.scale", "scales the lens of a file"),
        ("{fx: 1, fy: 1, cx: 0}", "", "camera.cy", "a key is missing"),
        ("{fx: 1, fy: -1, cx: 0, cy: 0}", "", "camera", "focal length"),
        ("{fx: 1, fy: 1, cx: 0, cy: 0, k4: 0.1}", "", "camera.k4", "not a number of a brown lens"),
        ("{model: fisheye, fx: 1, fy: 1, cx: 0, cy: 0, p1: 0.1}", "", "camera.p1", "not a number of a fisheye lens"),
        ("{model: fish, fx: 1, fy: 1, cx: 0, cy: 0}", "", "camera.model", "unknown value"),
        ("{model: fisheye, fx: 1, fy: 1, cx: 0, cy: 0, free: [p1]}", "", "camera.free", "not a number of a camera"),
        ("{fx: 1, fy: 1, cx: 0, cy: 0, sigma: {fx: 0}}", "", "camera.sigma.fx", "not a standard deviation"),
        ("{fx: 1, fy: 1, cx: 0, cy: 0, sigma: {fx: 1}, correlation: [[1, 0]]}", "", "camera.correlation[0]", "wrong number"),
        ("{name: left, file: lens.yaml}", "image: [1280]", "image", "wrong number of values"),
        ("{name: left, fx: 1400, fy: 1400, cx: 1280.5, cy: 480}", "image: [1280, 960]", "camera.cx", "centre lies outside"),
        ("{name: left, fx: 1400, fy: 1400, cx: 640, cy: -3}", "image: [1280, 960]", "camera.cy", "centre lies outside"),
        ("{name: left, file: lens.yaml}", "image: [0, 10]", "image[0]", "greater than 0"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_camera_is_said_by_key(tmp_path, camera, more, key, words):
    with pytest.raises(InputError, match=words) as error:
        read(tmp_path, camera, more)
    assert key is None or error.value.key == key, str(error.value)


def test_a_lens_outside_the_folder_is_not_repeated(tmp_path):
    (tmp_path / "secret.yaml").write_text("password: 12345\n", encoding="utf-8")
    (inner := tmp_path / "inner").mkdir()
    with pytest.raises(FormatError) as error:
        read_dataset(put(inner, *described("{name: left, file: ../secret.yaml}")), ARM)
    assert "password" not in str(error.value) and "secret.yaml" in str(error.value)


def test_two_files_of_one_camera(tmp_path):
    """One lens file in two data files is one prior; two priors of one name contradict each other."""
    read(tmp_path, "{name: left, file: lens.yaml}")
    first = tmp_path / "data.yaml"
    text = (
        first.read_text(encoding="utf-8")
        .replace("frame: {name: camera", "frame: {name: camera2")
        .replace("table.csv", "table2.csv")
    )
    (tmp_path / "table2.csv").write_text(
        (tmp_path / "table.csv").read_text(encoding="utf-8").replace("\np", "\nr"), encoding="utf-8"
    )
    second = tmp_path / "data2.yaml"
    second.write_text(text, encoding="utf-8")
    p = problem(ARM, read_dataset(first, ARM).dataset + read_dataset(second, ARM).dataset)
    assert len(p.table.together) == 1
    other = Lens.of("brown", NUMBERS, (1280, 960), KNOWN, np.diag(np.diag(SPREAD)))
    (tmp_path / "other.yaml").write_text(lens_text(other), encoding="utf-8")
    second.write_text(text.replace("lens.yaml", "other.yaml"), encoding="utf-8")
    with pytest.raises(ModelError, match="two different priors"):
        problem(ARM, read_dataset(first, ARM).dataset + read_dataset(second, ARM).dataset)


@pytest.mark.parametrize(
    ("lens", "told"),
    [
        ("fx: 1400, fy: 1400, cx: 640, cy: 480, k1: -3", True),
        ("fx: 300, fy: 300, cx: 640, cy: 480, model: fisheye, k1: -0.3", True),
        ("fx: 1400, fy: 1400, cx: 640, cy: 480, model: rational, k4: 5, k5: 9", True),
        ("fx: 1400, fy: 1400, cx: 640, cy: 480, k1: -0.3, k2: 0.1", False),
        ("fx: 1400, fy: 1400, cx: 640, cy: 480, k1: 0.5", False),
        ("fx: 600, fy: 600, cx: 640, cy: 480, model: fisheye, k1: 0.02, k2: -0.01", False),
    ],
)
def test_pixels_beyond_the_fold_are_counted(tmp_path, lens, told):
    """As many as no direction is imaged at, found on a grid of directions of the tests' own."""
    data = read(tmp_path, f"{{name: left, {lens}}}", lens=None).dataset
    found = list(lens_reach.run(Context(ARM, data)))
    numbers, seen = np.array(options_of(data)["intrinsics"]), data.observations[0].value
    r = np.linspace(0, 1.5, 20001)
    fish = len(numbers) == 8
    flat = np.column_stack([r, 0 * r, 1 + 0 * r])
    u = image_of(np.column_stack([np.sin(r), 0 * r, np.cos(r)]) if fish else flat, numbers)[:, 0]
    rising = np.append(np.diff(u) > 0, False)
    most = u[np.argmin(rising)] - numbers[2] if not rising[:-1].all() else np.inf
    lost = (np.hypot(*(seen - numbers[2:4]).T) > most).sum()
    assert bool(found) == told == bool(lost)
    if told:
        assert found[0].numbers["count"] == lost and found[0].numbers["radius"].value == pytest.approx(most, rel=1e-3)


def options_of(data):
    return data.observations[0].options


def test_a_lens_without_a_name_stands_beside_a_frame_called_camera(tmp_path):
    """The name of the frame in every example; the default was the same, and was refused as taken."""
    reading = read(tmp_path, "{file: lens.yaml}")
    assert reading.dataset.observations[0].frame.name == "camera"
    assert options(reading)["camera"] == "lens" and options(reading)["intrinsics"] == LENS.numbers


def two_files(tmp_path, first, second):
    """The example's rows as two data files with a lens each, and as one."""
    (tmp_path / "lens.yaml").write_text(lens_text(LENS, "robocal", "left"), encoding="utf-8")
    data, table = described("{name: left, file: ../lens.yaml}")
    head, *rows = table.splitlines()
    parts = []
    for name, own, some in (("a", first, rows[:20]), ("b", second, rows[20:]), ("all", "left", rows)):
        (tmp_path / name).mkdir()
        parts.append(
            put(tmp_path / name, data.replace("{name: left", f"{{name: {own}"), "\n".join([head, *some]) + "\n")
        )
    return parts


def test_two_files_of_one_lens_say_what_one_says(tmp_path):
    """Its prior is known once: the information of two files is that of one file with all rows."""
    *two, one = two_files(tmp_path, "left", "left")
    a, b = (problem(ARM, read_datasets(paths, ARM).dataset) for paths in (two, [one]))
    assert a.free == b.free and a.table.together == b.table.together and len(a.table.together) == 1
    expected = b.normal(b.start).a
    np.testing.assert_allclose(a.normal(a.start).a, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_two_names_of_one_lens_are_refused(tmp_path):
    """Else its prior would be two that have nothing in common, and every sigma too small."""
    *two, _ = two_files(tmp_path, "left", "other")
    with pytest.raises(FormatError, match="one lens has two names") as caught:
        read_datasets(two, ARM)
    assert caught.value.key == "camera.name" and "other, and left" in str(caught.value)
    for p in two:
        p.write_text(p.read_text().replace("lens.yaml", "lens.yaml, free: false"))
    assert len(read_datasets(two, ARM).dataset.observations) == 2  # nothing of it is identified
