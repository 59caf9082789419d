"""The verb `plan` from the command line to files, and from the files that it wrote to an identification."""

from __future__ import annotations

import csv
import io
import json
import re
from pathlib import Path

import numpy as np
import pytest
from cli.runs import files, robocal
from listings import rows_of

from robocal.files.pose_table import read_poses
from robocal.files.robot import read_robot

QUICK = ("--draw", 300)


def rows(path: Path) -> list[list[str]]:
    return list(csv.reader(io.StringIO(path.read_text(encoding="utf-8"))))


def test_a_plan_is_measured_and_identified(case: Path) -> None:
    ran = robocal("plan", "robot.yaml", "-n", 20, "-o", "plan", *QUICK)
    assert ran.status == 0, ran.err
    assert ran.out.index("Foretold error") < ran.out.index("Written to plan") < ran.out.index("next: measure")
    assert files(case / "plan") == {"poses.csv", "data.yaml", "data.csv", "plan.json", "plan.html"}
    made = json.loads((case / "plan" / "plan.json").read_text(encoding="utf-8"))
    page = (case / "plan" / "plan.html").read_text(encoding="utf-8")
    assert "20 chosen poses, and 300 of the candidates as grey dots" in page and made["candidates"] == 300
    chain = read_robot("robot.yaml").chain
    names, q, _ = read_poses("plan/poses.csv", chain)
    np.testing.assert_allclose(q, [[p[j] for j in chain.joint_names] for p in rows_of(made["program"])], atol=1e-9)
    assert list(names) == [p["id"] for p in rows_of(made["program"])] and len(names) == made["poses"] == 20
    assert sorted(p["rank"] for p in rows_of(made["program"])) == list(range(1, 21))
    low, high = chain.limits.T
    assert (q >= low - 1e-9).all() and (q <= high + 1e-9).all()
    # As it was written it is empty, and says so.
    robocal("identify", "robot.yaml", "plan/data.yaml").assert_refused("data.csv", "x")
    table = rows(case / "plan" / "data.csv")
    head, body = table[0], table[1:]
    at = [head.index(f"{c} [mm]") for c in "xyz"]
    assert all(row[i] == "" for row in body for i in at)
    measured = read_robot("truth.yaml").chain.pose(q)[:, :3, 3] + np.random.default_rng(0).normal(0, 5e-5, (20, 3))
    for row, p in zip(body, measured, strict=True):
        for i, v in zip(at, p, strict=True):
            row[i] = f"{1e3 * v:.6f}"
    (case / "plan" / "data.csv").write_text("\n".join(",".join(r) for r in table) + "\n", encoding="utf-8")
    done = robocal("identify", "robot.yaml", "plan/data.yaml", "-o", "run")
    assert done.status == 0, done.out + done.err


def test_the_page_shows_the_forecast_and_nothing_from_outside(case: Path) -> None:
    robocal("plan", "robot.yaml", "-n", 6, "-o", "plan", *QUICK)
    page = (case / "plan" / "plan.html").read_text(encoding="utf-8")
    made = json.loads((case / "plan" / "plan.json").read_text(encoding="utf-8"))
    assert page.count("<svg") == 3 and "three axes" in page and "6 poses" in page
    assert f"{made['accuracy']['mean']:.3g}"[:5] in page
    assert "http://www.w3.org/2000/svg" in page and "src=" not in page and "<script" not in page
    same = robocal("plan", "robot.yaml", "-n", 6, "-o", "again", *QUICK)
    assert same.status == 0 and page == (case / "again" / "plan.html").read_text(encoding="utf-8")


def test_a_plan_continues_from_what_was_measured(case: Path) -> None:
    alone = robocal("plan", "robot.yaml", "-n", 5, "--json", *QUICK).document
    after = robocal("plan", "robot.yaml", "--after", "data.yaml", "-n", 5, "--json", *QUICK).document
    assert after["measured_before"] == 30 and after["instruments"] == ["tracker"]
    first, last = rows_of(after["forecast"])[0]["mean"], after["accuracy"]["mean"]
    assert last < first < alone["accuracy"]["mean"]
    as_instrument = robocal("plan", "robot.yaml", "data.yaml", "-n", 5, "--json", *QUICK).document
    assert as_instrument["measured_before"] == 0 and as_instrument["instruments"] == ["tracker"]


def test_enough_is_as_many_as_the_accuracy_needs(case: Path) -> None:
    found = robocal("plan", "robot.yaml", "--accuracy", 0.05, "--json", *QUICK).document
    n = found["poses"]
    assert found["enough"] == n and found["accuracy"]["mean"] <= 0.051
    never = robocal("plan", "robot.yaml", "--accuracy", 0.0001, "-n", 4, *QUICK)
    assert never.status == 0 and "is not reached" in never.out + never.err


def test_a_list_of_poses_is_chosen_from(case: Path) -> None:
    robocal("plan", "robot.yaml", "-n", 12, "-o", "plan", *QUICK)
    found = robocal("plan", "robot.yaml", "-n", 5, "--candidates", "plan/poses.csv", "--tests", "data.yaml", "--json")
    assert found.status == 0, found.err
    assert found.document["candidates"] == 12 and found.document["tests"] == 30
    listed, _, _ = read_poses("plan/poses.csv", read_robot("robot.yaml").chain)
    assert {p["candidate"] for p in rows_of(found.document["program"])} < set(listed)


@pytest.mark.parametrize("kind", ["pose", "bearing", "range", "distance", "spherical", "pixels"])
def test_other_kinds_are_planned_and_their_tables_written(case: Path, kind: str) -> None:
    ran = robocal("plan", "robot.yaml", "-n", 6, "--kind", kind, "-o", "plan", "--json", *QUICK)
    assert ran.status == 0, ran.err
    assert ran.document["kind"] == kind and ran.document["warnings"] == []
    assert {"data.csv", "data.yaml"} <= files(case / "plan")
    assert len(rows(case / "plan" / "data.csv")) == 1 + 6 * {"range": 4, "pixels": 4}.get(kind, 1)


@pytest.mark.parametrize("kind", ["plane", "point", "sphere"])
def test_contacts_are_planned_from_a_list(kind: str, tmp_path: Path) -> None:
    """Of several places of the data one is planned for, and named; what was fitted of the others is no parameter of the plan."""
    from robocal.verbs.demo.cases import example_folder

    folder = example_folder("instruments") / kind
    data = ("--candidates", folder / "data.csv", "--poses", 8)
    ran = robocal("plan", folder / "robot.yaml", folder / "data.yaml", *data, "-o", tmp_path / "plan")
    assert ran.status == 0, ran.err
    (place,) = re.findall(r"place: \{name: (\w+)", (tmp_path / "plan" / "data.yaml").read_text(encoding="utf-8"))
    assert f"planned for {place} alone" in " ".join(ran.said.split())


def test_regions_are_in_the_file_s_units(case: Path) -> None:
    box = "-600,-600,100,600,600,500"
    robocal("plan", "robot.yaml", "-n", 8, "--box", box, "--floor", 50, "--pedestal", "100,300", "-o", "plan", *QUICK)
    chain = read_robot("robot.yaml").chain
    _, q, _ = read_poses("plan/poses.csv", chain)
    p = chain.pose(q)[:, :3, 3]
    assert (p[:, 2] >= 0.1 - 1e-9).all() and (p[:, 2] <= 0.5 + 1e-9).all() and (np.abs(p[:, :2]) <= 0.6 + 1e-9).all()
    assert ((np.hypot(p[:, 0], p[:, 1]) >= 0.1 - 1e-9) | (p[:, 2] >= 0.3 - 1e-9)).all()


def test_wrong_input_is_refused_and_nothing_is_written(case: Path) -> None:
    (case / "few.csv").write_text("id,j1 [deg],j2 [deg],j3 [deg]\na,1,2,3\na,4,5,6\n", encoding="utf-8")
    for words, said in (
        (("--criterion", "i5"), ("criterion", "i5")),
        (("--kind", "plane"), ("--kind", "plane", "DATA")),
        (("--kind", "displacement"), ("two configurations", "displacement")),
        (("--box", "1,2,3"), ("--box", "x0,y0,z0,x1,y1,z1")),
        (("--box", "0,0,0,0,1,1"), ("--box", "x0 < x1")),
        (("--box", "5000,5000,5000,6000,6000,6000"), ("box", "region")),
        (("--noise", "-1"), ("--noise",)),
        (("--accuracy", "nan"), ("--accuracy",)),
        (("--cone", "20"), ("--frame", "x,y,z,rx,ry,rz")),
        (("--pedestal", "-1,5"), ("--pedestal", "R above 0")),
        (("--range", "900,800"), ("--range", "MIN < MAX")),
        (("--candidates", "few.csv"), ("few.csv", "row 3", "one name")),
        (("--candidates", "none.csv"), ("none.csv",)),
    ):
        robocal("plan", "robot.yaml", "-n", 5, "-o", "plan", *words).assert_refused(*said)
    (case / "few.csv").write_text("id,j1 [deg],j2 [deg],j3 [deg]\na,1,2,3\nb,4,5,6\n", encoding="utf-8")
    refused = robocal("plan", "robot.yaml", "-n", 5, "-o", "plan", "--candidates", "few.csv")
    refused.assert_refused("fewer candidates", "2")
    assert not (case / "plan").exists()
    robocal("plan", "robot.yaml", "-n", 5, "-o", "plan", *QUICK)
    robocal("plan", "robot.yaml", "-n", 5, "-o", "plan", *QUICK).assert_refused("poses.csv", "--force")
