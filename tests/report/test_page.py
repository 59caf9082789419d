"""The page: whole, well formed, right about what is missing, safe against what names may contain, and the same every
time."""

from __future__ import annotations

import base64
import copy
import hashlib
import re
import sys
from html.parser import HTMLParser
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from report import samples

from robocal.errors import MissingExtra
from robocal.report.page import render

VOID = {"meta", "link", "br", "img", "input", "hr"}
SECTIONS = (
    "verdict",
    "errors",
    "parameters",
    "identifiability",
    "convergence",
    "correlation",
    "groups",
    "warnings",
    "recipe",
)
CASES = {
    "improved": samples.improved(),
    "pose": samples.improved(56, 15, angle=True),
    "refused": samples.refused(),
    "empty": samples.empty(),
}


class Page(HTMLParser):
    """Checks that every tag is closed in order; keeps identifiers, scripts, tags and the text that a reader sees."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.ids: list[str] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.scripts: list[tuple[dict[str, str | None], str]] = []
        self.words: list[str] = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = dict(attrs)
        assert len(found) == len(attrs), (tag, attrs)
        self.tags.append((tag, found))
        if "id" in found:
            self.ids.append(str(found["id"]))
        if tag == "script":
            self.scripts.append((found, ""))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open and self.open.pop() == tag, (tag, self.getpos())

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] == "script":
            attributes, text = self.scripts.pop()
            self.scripts.append((attributes, text + data))
        elif not self.open or self.open[-1] != "style":
            self.words.append(data)

    @property
    def text(self) -> str:
        return re.sub(r"[\s\u2007\u2008]+", " ", " ".join(self.words))


@pytest.mark.parametrize("name", CASES)
def test_is_well_formed_and_whole(name: str) -> None:
    text = render(*CASES[name])
    page = Page(text)
    assert text.lstrip().startswith("<!DOCTYPE html>")
    assert len(set(page.ids)) == len(page.ids)
    assert set(SECTIONS) <= set(page.ids)
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
    assert len(running) == 1
    digest = base64.b64encode(hashlib.sha256(running[0].encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'" in str(policy) and "default-src 'none'" in str(policy)
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
    tables = sum(t == "table" for t, _ in page.tags)
    assert sum(t == "caption" for t, _ in page.tags) == tables


def test_verdict_and_numbers_come_first() -> None:
    text = Page(render(*CASES["improved"])).text
    assert (
        text.index("Improved The corrected model is better")
        < text.index("times smaller")
        < text.index("Errors before, after and held out")
    )
    assert "40 of 150 configurations (27 %) were held out, chosen with seed 7" in text
    assert "19 identified, 1 prior, 3 dropped, 3 fixed." in text
    assert (
        "j1.r cannot be told from tracker.z" in text and "26 parameters were free" in text and "23 independent" in text
    )
    assert "noise is added until this is one" in text
    assert "9f86d081884c7d659a2feaa0c55ad015" in text and "robocal identify rv2aj.yaml" in text


def test_refused_says_what_failed_and_what_to_do() -> None:
    page = Page(render(*CASES["refused"]))
    text = page.text
    assert "Refused The model does not explain these measurements. Do not use" in text
    assert "What failed" in text and "What to do next" in text
    assert "Measure more configurations" in text and "the joint values explain nothing" in text.lower()
    # The single plane stands among the warnings, not among the reasons: it gives no hint.
    assert "Measure elsewhere too" not in text
    assert "Do not use these values." in text
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
        "No error statistics",
        "No residuals",
        "No correlations",
        "No iterations",
    ):
        assert line in text
    assert not re.search(r"\b(None|nan|inf|null|Undefined)\b", text)
    assert "No verdict" in Page(render({}, {})).text


EVIL = "\"><script>alert(1)</script><img src=x onerror='alert(2)'>{{ 7 * 7 }}</title></style></svg>\x00\ud800&lt;"


def poisoned(value: Any) -> Any:
    """Every text of a structure, keys of options included, with an attack behind it."""
    if isinstance(value, str):
        return value + EVIL
    if isinstance(value, list):
        return [poisoned(v) for v in value]
    if isinstance(value, dict):
        return {(k + EVIL if k in ("loss", "free") else k): poisoned(v) for k, v in value.items()}
    return value


def test_no_text_can_become_markup() -> None:
    result, rows = copy.deepcopy(CASES["improved"])
    clean = Page(render(result, rows))
    status, sets = result["verdict"]["status"], rows["set"]
    result, rows = poisoned(result), poisoned(rows)
    result["verdict"]["status"], rows["set"] = status, sets
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


def test_every_text_may_also_be_the_attack_itself() -> None:
    result, rows = copy.deepcopy(CASES["improved"])
    result["verdict"]["status"] = EVIL
    for p in result["parameters"]:
        p |= {"status": EVIL, "unit": EVIL, "nominal": EVIL, "sigma": EVIL}
    rows["before_mm"] = [EVIL] * 150
    rows["x_mm"] = [EVIL] * 150
    page = Page(render(result, rows))
    assert len([a for a, _ in page.scripts if a.get("type") is None]) == 1
    assert not any(t == "img" for t, _ in page.tags)


def test_same_input_same_bytes_and_untouched() -> None:
    result, rows = copy.deepcopy(CASES["pose"])
    assert render(result, rows) == render(*CASES["pose"])
    assert (result, rows) == CASES["pose"]


def test_is_small() -> None:
    assert len(render(*CASES["improved"]).encode()) < 200_000
    assert len(render(*samples.improved(1000, 250, angle=True)).encode()) < 700_000


def test_says_how_to_install_what_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "jinja2", None)
    with pytest.raises(MissingExtra, match=r"jinja2: pip install 'robocal\[report\]'"):
        render(*CASES["empty"])


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=6),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=4), inner, max_size=3),
    max_leaves=6,
)


def places(value: Any, here: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """The paths of all parts of a structure; of a list only the first two entries."""
    items = value.items() if isinstance(value, dict) else list(enumerate(value))[:2] if isinstance(value, list) else ()
    return [here] * bool(here) + [p for k, v in items for p in places(v, (*here, k))]


@pytest.mark.slow
@settings(max_examples=60)
@given(st.data())
def test_any_part_may_be_anything(data: st.DataObject) -> None:
    result, rows = samples.improved(12, 4, angle=True)
    for _ in range(3):
        *parents, last = data.draw(st.sampled_from(places(result)))
        target: Any = result
        for key in parents:
            target = target[key]
        target[last] = data.draw(JSON)
    column = data.draw(st.sampled_from(list(rows)))
    rows[column] = data.draw(st.lists(JSON, min_size=12, max_size=12))
    Page(render(result, rows))
