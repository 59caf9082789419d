"""Files of lenses: what is written comes back, OpenCV itself reads and writes it, and whatever is no lens is refused by key."""

from __future__ import annotations

import numpy as np
import pytest

from robocal.errors import FileError, FormatError, InputError, ModelError
from robocal.files.lens import FORMS, lens_text, read_lens
from robocal.vision.lenses import Lens

SIZE = (1280, 960)
LENSES = {
    "brown": [1400.123456789, 1399.5, 641.1, 482.25, -0.21, 0.05, 1e-5, -0.000321, 0.0],
    "rational": [1400.123456789, 1399.5, 641.1, 482.25, 0.4, 0.05, 1e-5, -0.000321, 0.01, 0.7, 0.1, 0.02],
    "fisheye": [400.123456789, 399.5, 641.1, 482.25, -0.02, 0.01, -1e-7, 3e-22],
}
ROS = """image_width: 640
image_height: 480
camera_name: narrow_stereo
camera_matrix:
  rows: 3
  cols: 3
  data: [438.78, 0., 305.59, 0., 437.34, 243.74, 0., 0., 1.]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.361976, 0.110510, 0.001014, 0.000505, 0.000000]
rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}
"""
KALIBR = """cam0:
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [-0.2834, 0.0739, 0.00019, 1.76e-05]
  distortion_model: radtan
  intrinsics: [458.654, 457.296, 367.215, 248.375]
  resolution: [752, 480]
  rostopic: /cam0/image_raw
cam1:
  T_cn_cnm1:
  - [0.99, 0.01, 0.0, -0.11]
  camera_model: pinhole
  distortion_coeffs: [-0.01, 0.02, 0.0, 0.0]
  distortion_model: equidistant
  intrinsics: [300.0, 301.0, 376.0, 240.0]
  resolution: [752, 480]
"""


def lens_of(model, covariance=True):
    rng = np.random.default_rng(8)
    numbers = LENSES[model]
    known = ("fx", "fy", "cx", "k1")
    a = rng.normal(size=(4, 4)) * [[1.0], [1.0], [0.5], [1e-3]]
    a[1] = a[0] + 1e-5 * a[1]  # fx and fy as one, nearly: what is written must still be a covariance
    return Lens.of(
        model, numbers, SIZE, known if covariance else (), a @ a.T if covariance else None, "36 images: a test"
    )


def write(tmp_path, text, name="lens.yaml"):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


@pytest.mark.parametrize("model", LENSES)
@pytest.mark.parametrize("form", FORMS)
def test_what_is_written_comes_back(tmp_path, form, model):
    if (form, model) == ("kalibr", "rational"):
        with pytest.raises(ModelError, match="Kalibr has no such lens"):
            lens_text(lens_of(model), form)
        return
    given = lens_of(model)
    back = read_lens(write(tmp_path, lens_text(given, form, "left")))
    assert (
        back.form == form and back.lens.numbers == given.numbers and back.lens.model == model and back.lens.size == SIZE
    )
    assert back.lens.known == (given.known if form == "robocal" else ())
    if form == "robocal":
        np.testing.assert_allclose(back.lens.covariance, given.covariance, rtol=1e-14)
        assert back.lens.source == given.source
        assert lens_text(back.lens) == lens_text(read_lens(write(tmp_path, lens_text(back.lens))).lens)


@pytest.mark.parametrize("model", LENSES)
def test_opencv_reads_what_is_written(tmp_path, model):
    cv2 = pytest.importorskip("cv2")
    path = write(tmp_path, lens_text(lens_of(model), "opencv"), "lens.yml")
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    k, d = (storage.getNode(n).mat() for n in ("camera_matrix", "distortion_coefficients"))
    assert [k[0, 0], k[1, 1], k[0, 2], k[1, 2], *d.ravel()] == LENSES[model] and storage.getNode(
        "image_width"
    ).real() == 1280


@pytest.mark.parametrize(
    ("model", "coefficients"), [("brown", 4), ("brown", 5), ("rational", 8), ("rational", 14), ("fisheye", 4)]
)
def test_what_opencv_writes_is_read(tmp_path, model, coefficients):
    cv2 = pytest.importorskip("cv2")
    n, path = np.array(LENSES[model]), tmp_path / "lens.yml"
    d = np.zeros(coefficients)
    d[: len(n) - 4] = n[4:][:coefficients]
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    storage.write("image_width", 640)
    storage.write("image_height", 480)
    storage.write("fisheye_model", int(model == "fisheye"))
    storage.write("camera_matrix", np.array([[n[0], 0, n[2]], [0, n[1], n[3]], [0, 0, 1]]))
    storage.write("distortion_coefficients", d.reshape(1, -1))
    storage.release()
    found = read_lens(path)
    assert found.form == "opencv" and found.lens.model == model and found.lens.size == (640, 480)
    np.testing.assert_array_equal(found.lens.numbers, n if coefficients != 4 else [*n[:8], *[0] * (len(n) - 8)])


def test_camera_info_and_camchain(tmp_path):
    ros = read_lens(write(tmp_path, ROS))
    assert ros.form == "ros" and ros.lens == Lens.of(
        "brown", [438.78, 437.34, 305.59, 243.74, -0.361976, 0.11051, 0.001014, 0.000505, 0], (640, 480)
    )
    kalibr = write(tmp_path, KALIBR)
    assert read_lens(kalibr, "cam1").lens == Lens.of("fisheye", [300, 301, 376, 240, -0.01, 0.02, 0, 0], (752, 480))
    assert read_lens(kalibr, "cam0").lens.model == "brown"
    with pytest.raises(FormatError, match="several cameras") as error:
        read_lens(kalibr, "left")
    assert error.value.expected == "cam0, cam1"


def test_half_pixel_rule():
    """Four pixels become one: the corner of the image stays where it is."""
    lens = lens_of("brown")
    half = lens.scale(0.5)
    assert half.size == (640, 480)
    for axis in (0, 1):
        f, c = lens.numbers[axis], lens.numbers[2 + axis]
        left = (-0.5 - c) / f  # the direction of the image's outer edge
        assert half.numbers[axis] * left + half.numbers[2 + axis] == pytest.approx(-0.5)
    np.testing.assert_allclose(half.numbers[4:], lens.numbers[4:])
    sigma, halved = lens.sigma, half.sigma
    assert halved["fx"] == pytest.approx(sigma["fx"] / 2) and halved["k1"] == pytest.approx(sigma["k1"])
    np.testing.assert_allclose(half.correlation, lens.correlation)


OWN = lens_text(lens_of("brown"))


@pytest.mark.parametrize(
    ("text", "words", "key"),
    [
        (OWN.replace("kind: lens", "kind: arm"), "this is no lens", "kind"),
        (OWN.replace("model: brown", "model: brwon"), "no such model", "model"),
        (OWN.replace("  k2:", "  k9:"), "not a number of a brown lens", "numbers.k9"),
        (OWN.replace("  k3: 0\n", ""), "a key is missing", "numbers.k3"),
        (OWN.replace("fy: 1399.5", "fy: wide"), "not a finite number", "numbers"),
        (OWN.replace("fy: 1399.5", f"fy: 1{'0' * 299}"), "no lens has so large a number", "numbers"),
        (OWN.replace("fy: 1399.5", "fy: -1399.5"), "above 0", "numbers"),
        (OWN.replace("[1280, 960]", "[1280]"), "wrong number of values", "image"),
        (OWN.replace("sigma: {fx", "sigma: {q"), "not a number of this lens", "sigma.q"),
        (OWN.replace("correlation: [[1,", "correlation: [[2,"), "correlation with itself", "correlation"),
        (OWN.replace("sourc", "sorce"), "unknown key", "sorcee"),
        ("robocal: 1\nkind: lens\nmodel: brown\n", "a key is missing", "numbers"),
        (ROS.replace("plumb_bob", "thin_prism"), "a distortion that is not read", "distortion_model"),
        (ROS.replace("438.78, 0.,", "438.78, 0.1,"), "right angles", "camera_matrix.data"),
        (ROS.replace("438.78", "-438.78"), "above 0", "camera_matrix.data"),
        (ROS.replace("cols: 5", "cols: 4"), "wrong number of values", "distortion_coefficients.data"),
        (ROS.replace("-0.361976", ".nan"), "not a finite number", "distortion_coefficients.data[0]"),
        (ROS.replace("image_height: 480\n", ""), "a key is missing", "image_height"),
        (KALIBR.split("cam1")[0].replace("radtan", "fov"), "not read", "cam0.distortion_model"),
        (KALIBR.split("cam1")[0].replace("pinhole", "omni"), "not read", "cam0.camera_model"),
        (KALIBR.split("cam1")[0].replace("[752, 480]", "[752.5, 480]"), "not a size", "cam0.resolution"),
        ("%YAML:1.0\n---\nimage_width: 3\n", "a key is missing", "camera_matrix"),
        ("robot: {}\n", "this is no lens", None),
        ("<?xml version='1.0'?><opencv_storage/>", "this is XML", None),
        ("%YAML:1.0\n---\ncamera_matrix: !!python/object:os.system\n", "tags", None),
    ],
)  # fmt: skip
def test_what_is_no_lens_is_refused_by_key(tmp_path, text, words, key):
    path = write(tmp_path, text)
    with pytest.raises(InputError, match=words) as error:
        read_lens(path)
    assert error.value.file == str(path) and (key is None or error.value.key == key)


@pytest.mark.parametrize("data", [b"", b"\x89PNG\r\n\x1a\n\0\0", b"\xff\xfer\0o\0", b"\0" * 100, b"- 1\n- 2\n"])
def test_no_text_at_all(tmp_path, data):
    with pytest.raises((FileError, FormatError)):
        read_lens(write(tmp_path, data))


def test_a_correlation_beyond_one_is_none(tmp_path):
    rows = OWN.index("correlation:")
    text = OWN[:rows] + "correlation: [[1, 1.5, 0, 0], [1.5, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]"
    with pytest.raises(FormatError) as error:
        read_lens(write(tmp_path, text))
    assert error.value.key == "correlation"


def test_formats_that_need_a_size():
    bare = Lens.of("brown", LENSES["brown"])
    for form in ("ros", "kalibr"):
        with pytest.raises(ModelError, match="size of the images"):
            lens_text(bare, form)
    assert "image" not in lens_text(bare)
    with pytest.raises(ModelError, match="no such format"):
        lens_text(bare, "ross")
