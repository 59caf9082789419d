"""Files of images as cameras and people leave them."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from robocal.errors import InputError
from robocal.files.image_files import find_images, name_views, read_images
from robocal.files.image_orientation import stated_orientation

cv2 = pytest.importorskip("cv2")
PLAIN = np.add.outer(np.arange(40), np.arange(60)).astype(np.uint8) * 2


def save(path, image, *how):
    path.parent.mkdir(exist_ok=True, parents=True)
    assert cv2.imwrite(str(path), image, list(how))
    return path


def read(*places):
    sources = find_images([str(p) for p in places])
    return list(read_images(sources, 1))


def test_numbers_in_names_are_in_the_order_of_numbers(tmp_path):
    for name in ("img10.png", "img2.png", "img1.jpg", "notes.md", ".hidden.png"):
        (tmp_path / name).write_bytes(b"x")
    names = ["img1", "img2", "img10"]
    assert [s.path.stem for s in find_images([str(tmp_path)])] == names
    assert [s.path.stem for s in find_images([str(tmp_path / "img*.png"), str(tmp_path / "img1.jpg")])] == names
    (tmp_path / "list.txt").write_text("img10.png\n\n# a comment\nimg2.png\n")
    assert [s.path.stem for s in find_images([str(tmp_path / "list.txt"), str(tmp_path / "img2.png")])] == names[1:]


def test_views_of_several_folders_have_names_of_their_own(tmp_path):
    for place in ("a/1.png", "b/1.png", "b/2.png"):
        save(tmp_path / place, PLAIN)
    assert name_views(find_images([str(tmp_path / "a"), str(tmp_path / "b")])) == ("a/1", "b/1", "b/2")
    save(tmp_path / "a/1.jpg", PLAIN)
    assert len(set(name_views(find_images([str(tmp_path / "a")])))) == 2


def test_colour_transparency_and_many_bits_have_the_same_levels(tmp_path):
    colour = cv2.cvtColor(PLAIN, cv2.COLOR_GRAY2BGR)
    deep = PLAIN.astype(np.uint16) * 257
    twelve = np.minimum(PLAIN.astype(np.uint16) * 16 + 15, 4095)
    twelve[0, 0] = 4095
    made = {
        "c.png": colour, "t.png": cv2.cvtColor(PLAIN, cv2.COLOR_GRAY2BGRA), "d.png": deep, "e.tiff": deep, "g.png": twelve, "h.bmp": PLAIN,
        "i.pgm": PLAIN,
    }  # fmt: skip
    deep[0, 0] = 65535
    for name, image in made.items():
        (one,) = read(save(tmp_path / name, image))
        assert one.grey.dtype == np.uint8 and one.grey.shape == PLAIN.shape, name
        assert np.abs(one.levels[1:] - PLAIN[1:]).max() <= 1.1, name


def turned(path, way, image=PLAIN):
    """A JPEG whose EXIF says how the camera was turned."""
    data = save(path, image).read_bytes()
    entry = struct.pack("<HHIHH", 0x0112, 3, 1, way, 0)
    exif = b"Exif\0\0II*\0\x08\0\0\0" + struct.pack("<H", 1) + entry + b"\0\0\0\0"
    path.write_bytes(data[:2] + b"\xff\xe1" + struct.pack(">H", len(exif) + 2) + exif + data[2:])
    return path


def turned_tiff(path, way, image=PLAIN):
    """The same of a TIFF, among its own tags."""
    data = save(path, image, cv2.IMWRITE_TIFF_COMPRESSION, 1).read_bytes()
    (at,) = struct.unpack("<I", data[4:8])
    (count,) = struct.unpack("<H", data[at : at + 2])
    entries = [data[at + 2 + 12 * k : at + 14 + 12 * k] for k in range(count)]
    entries.append(struct.pack("<HHIHH", 0x0112, 3, 1, way, 0))
    entries.sort(key=lambda e: struct.unpack("<H", e[:2]))
    path.write_bytes(
        data[:4] + struct.pack("<I", len(data)) + data[8:] + struct.pack("<H", count + 1) + b"".join(entries) + bytes(4)
    )
    return path


@pytest.mark.parametrize("way", range(1, 9))
def test_an_image_lies_as_the_sensor_stored_it_whatever_exif_states(tmp_path, way):
    """Turned or mirrored, its pixels would not be those of the lens."""
    for made in (turned(tmp_path / "a.jpg", way), turned_tiff(tmp_path / "b.tiff", way)):
        (one,) = read(made)
        assert one.grey.shape == PLAIN.shape and one.turned == (way != 1), made.name
        assert np.abs(one.levels - PLAIN).max() < 8, made.name
        shown = cv2.imdecode(np.frombuffer(made.read_bytes(), np.uint8), cv2.IMREAD_GRAYSCALE)
        assert (
            way == 1 or shown.shape != PLAIN.shape or np.abs(shown.astype(float) - PLAIN).max() > 20
        )  # others turn it


def test_an_orientation_that_is_none_is_none():
    assert [
        stated_orientation(d) for d in (b"", b"II*\0", b"Exif\0\0II*\0\xff\xff\xff\xff", b"MM\0*\0\0\0\x08\0\xff")
    ] == [1] * 4
    nine = b"II*\0\x08\0\0\0\x01\0" + struct.pack("<HHIHH", 0x0112, 3, 1, 9, 0)
    assert stated_orientation(nine) == 1


def bad_files(folder):
    """Files by name, with a word of what is wrong."""
    png, jpg = save(folder / "whole.png", PLAIN).read_bytes(), save(folder / "whole.jpg", PLAIN).read_bytes()
    bmp = save(folder / "whole.bmp", PLAIN).read_bytes()
    header = png[:16] + struct.pack(">II", 200_000, 100_000) + png[24:]
    return {
        "half.png": (png[: len(png) // 2], "ends early"), "half.jpg": (jpg[: len(jpg) // 2], "ends early"),
        "half.bmp": (bmp[: len(bmp) // 2], "ends early"), "empty.png": (b"", "empty"), "text.png": (b"not an image", "not an image"),
        "bomb.png": (header, "too large"), "tiny.png": (cv2.imencode(".png", PLAIN[:3, :3])[1].tobytes(), "too small"),
        "film.mp4": (b"\0" * 100, "video"), "black.tiff": (cv2.imencode(".tiff", PLAIN.astype(np.uint16) * 0)[1].tobytes(), "brightness"),
    }  # fmt: skip


def test_a_bad_file_is_named_with_what_is_wrong(tmp_path):
    for name, (data, word) in bad_files(tmp_path).items():
        (tmp_path / name).write_bytes(data)
        with pytest.raises(InputError, match=word) as told:
            read(tmp_path / name)
        assert name in str(told.value)
    (tmp_path / "none").mkdir()
    for place in ("none", "missing.png", "no*.png"):
        with pytest.raises(InputError) as told:
            read(tmp_path / place)
        assert place in str(told.value)


def test_frames_of_a_video(tmp_path):
    path = tmp_path / "film.avi"
    film = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), 10, (64, 48))
    if not film.isOpened():
        pytest.skip("this OpenCV writes no video")
    for k in range(25):
        film.write(np.full((48, 64, 3), 5 * k + 20, np.uint8))
    film.release()
    frames = list(read_images(find_images([str(path)]), 10))
    assert [f.view for f in frames] == ["film-0", "film-10", "film-20"]
    assert [round(float(f.grey.mean())) for f in frames] == pytest.approx([20, 70, 120], abs=4)
