"""The page: whole, well formed, right about what is missing, safe against what names may contain, and the same every
time."""

from __future__ import annotations

import base64
import copy
import hashlib
import re
from typing import Any

import pytest
from report import samples
from report.markup import Page

from robocal.report.identified import identification_sections, report
from robocal.report.page import embed

SECTIONS = ("errors", "parameters", "identifiability", "convergence", "correlation", "groups", "warnings", "recipe")
CASES = {
    "improved": samples.improved(),
    "pose": samples.improved(56, 15, angle=True),
    "refused": samples.refused(),
    "empty": samples.empty(),
}


def render(document: dict[str, Any], rows: dict[str, list[Any]]) -> str:
    """The page of a document."""
    return report(samples.result(document), rows, None)


@pytest.mark.parametrize("name", CASES)
def test_is_well_formed_and_whole(name: str) -> None:
    text = render(*CASES[name])
    page = Page(text)
    assert text.lstrip().startswith("<!DOCTYPE html>")
    assert len(set(page.ids)) == len(page.ids)
    # Of a result that warns of nothing nothing is said.
    assert set(SECTIONS) <= {*page.ids, *(("warnings",) if name == "empty" else ())}
    assert {a["href"][1:] for t, a in page.tags if t == "a" and a["href"]} <= set(page.ids)
    for _, attributes in page.tags:
        for key in ("aria-labelledby", "for"):
            assert set((attributes.get(key) or "").split()) <= set(page.ids)


@pytest.mark.parametrize("name", CASES)
def test_needs_nothing_from_outside_and_runs_only_its_own_script(name: str) -> None:
    text = render(*CASES[name])
    page = Page(text)
    assert not re.search(r"""(src|href)=["']?(https?:|//)|url\(|@import""", text)
    assert set(re.findall(r"https?://[^\"'\s<]+", text)) <= {"http://www.w3.org/2000/svg"}
    policy = next(
        a["content"] for t, a in page.tags if t == "meta" and a.get("http-equiv") == "Content-Security-Policy"
    )
    running = [body for attributes, body in page.scripts if attributes.get("type") != "application/json"]
    digests = [base64.b64encode(hashlib.sha256(r.encode()).digest()).decode() for r in running]
    allowed = re.findall(r"'sha256-([^']+)'", str(policy))
    assert allowed == digests and len(digests) == (1 if name == "empty" else 2) and "default-src 'none'" in str(policy)
    assert not any(key.startswith("on") for _, attributes in page.tags for key in attributes)


@pytest.mark.parametrize("name", CASES)
def test_is_accessible(name: str) -> None:
    page = Page(render(*CASES[name]))
    assert [a.get("lang") for t, a in page.tags if t == "html"] == ["en"]
    for tag, attributes in page.tags:
        if tag == "svg":
            assert attributes.get("aria-hidden") == "true" or (
                attributes.get("role") == "img" and attributes.get("aria-labelledby")
            )
        if tag == "th":
            assert attributes.get("scope") in ("row", "col")
    labels = [a.get("aria-label") for t, a in page.tags if t == "div" and a.get("class") == "scroll" and "role" in a]
    assert len(labels) == sum(t == "table" for t, _ in page.tags) and all(labels)


def test_verdict_and_numbers_come_first() -> None:
    text = Page(render(*CASES["improved"])).text
    body = text[text.index("Improved The corrected model is better") :]
    assert (
        body.index("95 % interval")
        < body.index("Held out, before")
        < body.index("times smaller")
        < body.index("Held out means: set aside")
    )
    assert "40 of 150 configurations (27 %) were held out, chosen with seed 7" in text
    assert "19 identified, 1 only in combination or by prior, 3 not seen, 3 fixed" in text
    assert (
        "j1.r cannot be separated from tracker.z" in text
        and "26 parameters were free" in text
        and "23 independent" in text
    )
    assert "noise is added until this is one" in text
    assert "9f86d081884c7d659a2feaa0c55ad015" in text and "robocal identify rv2aj.yaml" in text


def test_held_out_before_stands_beside_held_out_after() -> None:
    tiles = re.findall(r'<div class="tile (\w+)"><div class="name">.*?</svg>([^<]+)</div>', render(*CASES["improved"]))
    assert tiles == [("before", "Held out, before"), ("held", "Held out, after"), ("after", "After, seen by the fit")]


def test_every_tile_says_what_a_table_says() -> None:
    """Big numbers have three digits of those in the table."""
    document, rows = CASES["improved"]
    page = render(document, rows)
    shown = [float(v) for v in re.findall(r'<div class="number">([\d.]+)<small>mm', page)]
    known = [document["residuals"][k]["mean"] for k in ("held_out_before", "held_out", "after")]
    assert shown == pytest.approx(known, rel=5e-3)


@pytest.mark.parametrize("status", ["improved", "not_improved", "refused"])
def test_only_a_model_that_is_to_be_used_is_praised(status: str) -> None:
    """No page says "7585 times smaller" above "keep the nominal one"."""
    document, rows = copy.deepcopy(CASES["improved"])
    document["verdict"]["status"] = status
    text = Page(render(document, rows)).text
    head = text[: text.index("Where the errors point")]
    assert ("never saw, the mean error went from" in head) == (status != "improved")  # else the large numbers say it
    assert ("times smaller" in head) == (status == "improved")


def test_refused_says_what_failed_and_what_to_do() -> None:
    page = Page(render(*CASES["refused"]))
    text = page.text
    assert "Refused The model does not explain these measurements. Do not use" in text
    assert "Why" in text and "What to do next" in text
    assert "Measure more configurations" in text and "the joint values explain nothing" in text.lower()
    # The single plane stands among the warnings, not among the reasons: it gives no hint.
    assert "Measure elsewhere too" not in text
    assert "Do not use these values" in text
    assert "Leave one out means" in text and "each configuration was predicted from all the others" in text


def test_without_hold_out_it_says_that_nothing_is_proven() -> None:
    result, rows = copy.deepcopy(CASES["improved"])
    result["residuals"] |= {"held_out": None, "held_out_before": None}
    result["split"] = {"held_out_fraction": 0, "seed": None, "fit": rows["configuration"], "held_out": []}
    rows["set"] = ["fit"] * len(rows["set"])
    rows["held_out_mm"] = [None] * len(rows["set"])
    text = Page(render(result, rows)).text
    assert (
        "Nothing was held out. The error of 0.0586 mm was computed on the measurements that the model was fitted to"
        in text
    )
    assert "no proof on unseen measurements" in text
    assert "configurations were held out" not in text


def test_empty_result_gives_a_page_that_says_so() -> None:
    text = Page(render(*CASES["empty"])).text
    for line in (
        "Unnamed robot",
        "Not improved",
        "nothing is proven",
        "No residuals",
        "There are no correlations",
        "0 iterations",
    ):
        assert line in text
    assert not re.search(r"\b(None|nan|inf|null|Undefined)\b", text)


EVIL = "\"><script>alert(1)</script><img src=x onerror='alert(2)'>{{ 7 * 7 }}</title></style></svg>\x00\ud800&lt;"


TAME = EVIL.replace("\x00", "").replace("\ud800", "")  # what result.json can hold


def poisoned(value: Any, attack: str) -> Any:
    """Every text of a structure, keys of options included, with an attack behind it."""
    if isinstance(value, str):
        return value + attack
    if isinstance(value, list):
        return [poisoned(v, attack) for v in value]
    if isinstance(value, dict):
        return {(k + attack if k in ("loss", "free") else k): poisoned(v, attack) for k, v in value.items()}
    return value


def test_no_text_can_become_markup() -> None:
    result, rows = copy.deepcopy(CASES["improved"])
    clean = Page(render(result, rows))
    status, sets = result["verdict"]["status"], rows["set"]
    unit, kinds = result["residuals"]["unit"], [p["unit"] for p in result["parameters"]]
    result, rows = poisoned(result, TAME), poisoned(rows, EVIL)
    result["verdict"]["status"], rows["set"], result["residuals"]["unit"] = status, sets, unit
    assert all(p["unit"] != u for p, u in zip(result["parameters"], kinds, strict=True))
    for p, q in zip(result["parameters"], CASES["improved"][0]["parameters"], strict=True):
        p["status"] = q["status"]
    text = render(result, rows)
    page = Page(text)
    assert len(page.scripts) == len(clean.scripts)
    assert not any(t == "img" or any(k.startswith("on") for k in a) for t, a in page.tags)
    assert "<script>alert" not in text and "49" not in re.findall(r"<h1>.*?</h1>", text, re.S)[0]
    assert "\x00" not in text
    text.encode("utf-8")
    assert {t for t, _ in page.tags} == {t for t, _ in clean.tags}


def test_columns_may_be_the_attack_itself() -> None:
    result, rows = copy.deepcopy(CASES["improved"])
    for p in result["parameters"]:
        p |= {"name": TAME, "unit": TAME}
    rows["before_mm"] = [EVIL] * 150
    rows["x_mm"] = [EVIL] * 150
    page = Page(render(result, rows))
    assert not any(t == "img" for t, _ in page.tags)


def test_same_input_same_bytes_and_untouched() -> None:
    result, rows = copy.deepcopy(CASES["pose"])
    assert render(result, rows) == render(*CASES["pose"])
    assert (result, rows) == CASES["pose"]


def test_is_small() -> None:
    assert len(render(*CASES["improved"]).encode()) < 200_000
    assert len(render(*samples.improved(1000, 250, angle=True)).encode()) < 700_000


@pytest.mark.parametrize("status", ["improved", "not_improved", "refused"])
@pytest.mark.parametrize("warned", [False, True])
def test_no_doubt_is_said_only_of_good_news_without_a_remark(status: str, warned: bool) -> None:
    document, rows = copy.deepcopy(CASES["improved"])
    document["verdict"]["status"] = status
    document["remarks"], document["warnings"] = [], ["something is odd " * 40] if warned else []
    said = "no doubt was found" in Page(render(document, rows)).text
    assert said == (status == "improved" and not warned)


def test_what_was_left_out_is_counted() -> None:
    document, rows = copy.deepcopy(CASES["improved"])
    document["provenance"]["left_out"] = [{"file": "a.csv", "rows": [3, 4, 9], "why": "excluded"}]
    assert "3 rows excluded" in Page(render(document, rows)).text
    document["identifiability"]["dropped"] = []  # --keep-all
    assert "stay nominal" not in Page(render(document, rows)).text.split("Where the errors point")[0]


def test_paper_opens_the_fold_in_two_columns_and_a_notebook_hears_nothing_of_paper() -> None:
    document, rows = CASES["improved"]
    text = render(document, rows)
    printed = text[text.index("@media print") : text.index("</style>")]
    assert "details::details-content" in printed and "columns: 2" in printed and "table-header-group" in printed
    shown = embed(list(identification_sections(samples.result(document), rows)), "run")
    assert "<style>" in shown and "@page" not in shown and "@media print" not in shown


def test_what_hides_a_parameter_and_what_was_fixed_are_said_once() -> None:
    document, rows = copy.deepcopy(CASES["improved"][0]), CASES["improved"][1]
    document["parameters"].append({**document["parameters"][0], "name": "j9.gain", "status": "fixed", "delta": None})
    text = render(document, rows)
    hidden = text[text.index('id="identifiability"') :].partition("</section>")[0]
    told = [c["text"] for c in document["identifiability"]["combinations"] if len(c["terms"]) > 1]
    assert told and all(hidden.count(f">{line}<") == 1 for line in told)
    # Nothing but its value and its status is known of what was not fitted.
    fixed = re.search(r"<summary>\d+ fixed</summary>.*?</table>", text, re.S)
    assert fixed and "j9.gain" in fixed[0] and re.findall(r'scope="col"[^>]*>([^<]*)<', fixed[0]) == [
        "parameter", "nominal", "unit", "status",
    ]  # fmt: skip
