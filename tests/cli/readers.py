"""Every reader of files with small valid samples: what is read, by which function, and a command that does the same."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from cli.runs import robocal, small
from cli.worlds import CABLE, FLAT_PLACES, PLACES, PLANAR, POSES, REGION, TARGETS, URDF, Command
from files.kind_samples import ARM, KINDS, texts
from files.test_cable import caspr
from files.test_dialects import WRITTEN
from files.test_forty_urdfs import COUNT, sample

from robocal.arms import catalog
from robocal.arms.conventions import CONVENTIONS
from robocal.errors import MissingExtra
from robocal.files.cable.cable_robot import read_cable
from robocal.files.cable.caspr import open_caspr
from robocal.files.cable.pose_lists import read_cable_lengths, read_platform_poses
from robocal.files.covariance import read_covariance
from robocal.files.dataset import read_dataset
from robocal.files.image_files import find_images, read_images
from robocal.files.images import opencv
from robocal.files.offset_file import read_offsets
from robocal.files.pose_table import read_poses, read_region
from robocal.files.result import read_result
from robocal.files.robot import open_robot
from robocal.files.runfolder import read_accuracy, read_residuals
from robocal.files.sheet import read_sheet
from robocal.files.studyfile import read_study
from robocal.files.table_description import describe_table
from robocal.files.targets import read_targets
from robocal.files.templates import convention_chain, templates
from robocal.files.text import read_text
from robocal.session.inputs import open_machine
from robocal.session.pose_groups import summarise_groups
from robocal.session.runs import with_history

EXAMPLES = Path(__file__).parents[2] / "examples"
UR10 = catalog.get("ur10")
GROUPS = "group,n,x_mean [mm],x_sd [mm],y_mean [mm],y_sd [mm]\na,5,1.5,0.2,3.1,0.4\nb,7,1.2,0.3,2.9,0.2\n"
HISTORY = "2026-03-01T10:00:00,box,march/run,improved,w1.x,1.25,0.01,mm\n2026-06-01T10:00:00,box,june/run,improved,w1.x,1.5,,mm\n"


@dataclass(frozen=True)
class Reader:
    """Files by name, what reads them in a folder, and the command that reads them (none where it takes long)."""

    name: str
    files: dict[str, bytes]
    read: Callable[[Path], object]
    command: Command | None = None
    still: tuple[str, ...] = ()  # files that are needed and not damaged


def _of(
    name: str,
    files: dict[str, str | bytes],
    read: Callable[[Path], object],
    command: Command | None = None,
    still: tuple[str, ...] = (),
) -> Reader:
    return Reader(name, {k: v if isinstance(v, bytes) else v.encode() for k, v in files.items()}, read, command, still)


def readers(folder: Path) -> list[list[Reader]]:
    """The readers, each with its samples."""
    return [
        list(group)
        for group in (
            _robots(),
            _urdfs(),
            _cables(folder),
            _kinds(folder),
            _tables(),
            _lists(folder),
            _documents(folder),
            _cable_data(),
            _images(folder),
        )
        if group is not None
    ]


def _robots() -> Iterator[Reader]:
    for convention in CONVENTIONS:
        text = templates(convention_chain(convention, 3))["robot.yaml"]
        yield _of("robot", {"robot.yaml": text}, lambda f: open_robot(f / "robot.yaml"), ("check", "robot.yaml"))


def _urdfs() -> Iterator[Reader]:
    for data in (URDF.encode(), *(s.data for s in map(sample, range(COUNT)) if not s.refusal)):
        yield _of(
            "urdf",
            {"u.urdf": data},
            lambda f: open_robot(f / "u.urdf"),
            ("export", "u.urdf", "--format", "urdf", "-o", "out"),
        )


def _cables(folder: Path) -> Iterator[Reader]:
    published = [p.read_text() for p in sorted((EXAMPLES / "cable-published").glob("*.yaml"))]
    for text in (CABLE, PLANAR, *published):
        yield _of("cable", {"robot.yaml": text}, lambda f: read_cable(f / "robot.yaml"), ("check", "robot.yaml"))
    caspr(folder)
    made: dict[str, str | bytes] = {n: (folder / n).read_bytes() for n in ("flat_cables.xml", "flat_bodies.xml")}
    yield _of(
        "caspr",
        made,
        lambda f: open_caspr(read_text(f / "flat_cables.xml")),
        ("import", "flat_cables.xml", "-o", "out"),
    )
    for robot, places in ((CABLE, PLACES), (PLANAR, FLAT_PLACES)):
        (folder / "robot.yaml").write_text(robot)
        (folder / "list.csv").write_text(places)
        machine = read_cable(folder / "robot.yaml").robot
        lengths = robocal("cable", "inverse", folder / "robot.yaml", folder / "list.csv").out
        poses, back = ({"robot.yaml": robot, "list.csv": text} for text in (places, lengths))
        yield _of("poses of a platform", poses, lambda f, m=machine: read_platform_poses(f / "list.csv", m), ("cable", "inverse", "robot.yaml", "list.csv", "-o", "out"), ("robot.yaml",))  # fmt: skip
        yield _of(
            "lengths of cables", back, lambda f, m=machine: read_cable_lengths(f / "list.csv", m), None, ("robot.yaml",)
        )


def _kinds(folder: Path) -> Iterator[Reader]:
    robot = small(folder / "arm", poses=14)["robot.yaml"]
    for kind in KINDS:
        described, table = texts(kind)
        made: dict[str, str | bytes] = {"robot.yaml": robot, "data.yaml": described, "table.csv": table}
        yield _of(
            kind,
            made,
            lambda f: read_dataset(f / "data.yaml", ARM),
            ("check", "robot.yaml", "data.yaml"),
            ("robot.yaml",),
        )


def _tables() -> Iterator[Reader]:
    rng = np.random.default_rng(3)
    rows = np.hstack([rng.uniform(-90, 90, (12, 6)), rng.uniform(-3000, 3000, (12, 3))]).round(4)

    def read(folder: Path) -> object:
        described = describe_table(folder / "table.csv", UR10, None, folder)
        return described, read_dataset(folder / "table.csv", UR10)

    for written in WRITTEN.values():
        yield _of("table", {"table.csv": written(rows)}, read, ("new", "ur10", "--table", "table.csv", "-o", "out"))


def _lists(folder: Path) -> Iterator[Reader]:
    robot = (folder / "arm" / "robot.yaml").read_text()
    still = ("robot.yaml",)
    yield _of("poses", {"robot.yaml": robot, "list.csv": POSES}, lambda f: read_poses(f / "list.csv", ARM), None, still)
    yield _of("targets", {"list.csv": TARGETS}, lambda f: read_targets(f / "list.csv", ARM))
    described = "robocal: 1\nkind: targets\nfile: list.csv\njoints: {columns: [j1, j2, j3], unit: deg}\nconfiguration: {id: id}\n"
    yield _of(
        "described targets",
        {"targets.yaml": described, "list.csv": TARGETS},
        lambda f: read_targets(f / "targets.yaml", ARM),
    )
    yield _of("region", {"region.yaml": REGION}, lambda f: read_region(f / "region.yaml", ARM))
    yield _of(
        "history",
        {"history.csv": "started,robot,run,verdict,parameter,value,sigma,unit\n" + HISTORY},
        lambda f: with_history(f / "history.csv", ()),
    )
    yield _of("groups", {"groups.csv": GROUPS}, lambda f: summarise_groups(str(f / "groups.csv")))
    verified: dict[str, str | bytes] = {"one.csv": PLACES, "two.csv": PLACES.replace("100,", "100.5,")}
    yield _of("pairs", verified, lambda f: None, ("verify", "one.csv", "two.csv"))
    for place in sorted((EXAMPLES / "studies").glob("figure-b.[1-3].yaml")) + [
        EXAMPLES / "studies" / "coverage-of-an-arm.yaml"
    ]:
        text = place.read_text().replace("../", f"{EXAMPLES}/")
        yield _of("study", {"study.yaml": text}, lambda f: read_study(f / "study.yaml"))


def _documents(folder: Path) -> Iterator[Reader]:
    arm = folder / "arm"
    ran = robocal("identify", arm / "robot.yaml", arm / "data.yaml", "-o", arm / "run")
    assert ran.status in (0, 3), ran.said
    read = {
        "result.json": read_result,
        "covariance.json": read_covariance,
        "residuals.csv": read_residuals,
        "accuracy_map.csv": read_accuracy,
    }
    for name, function in read.items():
        files: dict[str, str | bytes] = {name: (arm / "run" / name).read_bytes()}
        yield _of(name, files, lambda f, n=name, r=function: r(f / n))
    whole: dict[str, str | bytes] = {
        f"run/{p.name}": p.read_bytes() for p in (arm / "run").iterdir() if p.suffix != ".html"
    }
    yield _of(
        "run folder", whole, lambda f: open_machine(f / "run"), ("export", "run", "--format", "yaml", "-o", "out")
    )
    for form, name in (("offsets", "offsets.csv"), ("ros", "offsets.yaml"), ("xacro", "offsets.xacro")):
        text = robocal("export", arm / "run", "--format", form).out
        yield _of("offsets", {name: text}, lambda f, n=name: read_offsets(f / n, ARM))


def _images(folder: Path) -> list[Reader] | None:
    """Printed sheets, lists of images, and images; none without OpenCV."""
    try:
        cv2 = opencv()
    except MissingExtra:
        return None
    made = []
    for pattern in ("grid", "charuco", "aprilgrid"):
        words = ("--pattern", pattern, "--columns", 3, "--rows", 3)
        assert robocal("vision", "sheet", *words, "-o", folder / f"{pattern}.pdf").status == 0
        text = (folder / f"{pattern}.yaml").read_text()
        made.append(_of("sheet", {"sheet.yaml": text}, lambda f: read_sheet(f / "sheet.yaml")))
    ramp = np.add.outer(np.arange(40), np.arange(60)).astype(np.uint8) * 2
    images: dict[str, str | bytes] = {f"a.{e}": cv2.imencode(f".{e}", ramp)[1].tobytes() for e in ("png", "jpg", "pgm")}
    for name in images:
        made.append(_of("image", {name: images[name]}, lambda f, n=name: list(read_images(find_images([str(f / n)])))))
    listed = {"list.txt": "a.png\na.jpg\n"} | images
    made.append(_of("list of images", listed, lambda f: list(read_images(find_images([str(f / "list.txt")])))))
    return made


def _cable_data() -> Iterator[Reader]:
    for where, names in (("four", ("lengths", "swivel", "tilt")), ("march", ("lengths", "poses"))):
        place = EXAMPLES / "cable-calibration" / where
        robot = (place / "robot.yaml").read_bytes()
        machine = open_machine(place / "robot.yaml").machine
        for name in names:
            table = b"".join((place / f"{name}.csv").read_bytes().splitlines(True)[:12])
            made: dict[str, str | bytes] = {
                "robot.yaml": robot,
                f"{name}.yaml": (place / f"{name}.yaml").read_bytes(),
                f"{name}.csv": table,
            }
            yield _of(
                f"cable {name}",
                made,
                lambda f, m=machine, n=name: read_dataset(f / f"{n}.yaml", m),
                None,
                ("robot.yaml",),
            )
