"""No two sentences of one screen contradict each other: what results of good and of damaged data claim is compared."""

from __future__ import annotations

import html
import json
import os
import re

import numpy as np
import pytest
from advice import UNSEEN, arm, cables
from advice_arms import labelled
from cli.runs import robocal

FULL = bool(os.environ.get("ROBOCAL_FULL"))
WORDS = {"improved": "IMPROVED", "not_improved": "NOT IMPROVED", "refused": "REFUSED", "located": "LOCATED"}


def _step(q, p, rng):
    p[len(p) // 2 :] += [4e-3, 0, 3e-3]
    return q, p


def _gross(q, p, rng):
    p[:3] += rng.normal(size=(3, 3)) * 0.05
    return q, p


def _stray(q, p, rng):
    return q + 8e-3 * np.sin(q + np.arange(q.shape[1])), p


def _late(y, p, w):
    return y[:-1], p[1:], w[1:]


def _slip(y, p, w):
    y[30:, 1] += 0.015
    return y, p, w


ARMS = {
    "good": {},
    "seven": {"arm": "seven"},
    "few": {"m": 9},
    "some": {"m": 20},
    "noise": {"noise": 2e-3, "sigma": 2e-3},
    "unstated": {"noise": 1e-3, "sigma": 1e-5},
    "overstated": {"sigma": 3e-3},
    "faint": {"size": 0.05},
    "nominal": {"size": 0.0},
    "computed": {"noise": 0.0},
    "corner": {"share": 0.1},
    "step": {"spoil": _step, "m": 60},
    "gross": {"spoil": _gross},
    "stray": {"spoil": _stray, "m": 60},
    "scale": {"spoil": lambda q, p, rng: (q, 1.02 * p), "m": 80},
    "shuffled": {"spoil": lambda q, p, rng: (q[rng.permutation(len(q))], p), "m": 60},
}
CABLES = {
    "good": {},
    "four": {"name": "four"},
    "few": {"m": 10},
    "drums": {"spoil": lambda y, p, w: (1.01 * y, p, w), "m": 50},
    "slip": {"spoil": _slip, "m": 50},
    "late": {"spoil": _late, "m": 50, "step": 0.08},
    "zeros": {"zero": 0.3},
    "far": {"size": 0.2},
    "nominal": {"size": 0.0, "zero": 0.0},
}
EVERY = [("arm", k) for k in ARMS] + [("cables", k) for k in CABLES] + [("labels", "wrong")]
QUICK = ("corner", "few", "faint", "drums")


def made(folder, kind, name, seed):
    if kind == "labels":
        return (*labelled(folder, 0.5, 60), "--fix", "tool", "--loss", "huber")
    how = dict((ARMS if kind == "arm" else CABLES)[name])
    return (arm if kind == "arm" else cables)(folder, seed=seed, **how)


def amount(value):
    """A quantity of a remark in its unit."""
    return value["value"] if isinstance(value, dict) else value


def same(one, other, digits=5e-3):
    return abs(one - other) <= digits * max(abs(one), abs(other), 1e-12)


def contradictions(ran, document, page):
    """What two places of one result say that cannot both be."""
    found, verdict = [], document["verdict"]
    status, said = verdict["status"], ran.said
    reasons, remarks = verdict["remarks"], document["remarks"]
    by = {r["code"]: r["numbers"] for r in (*remarks, *reasons)}

    def claim(holds, words):
        if not holds:
            found.append(words)

    good = status == "located" or (status == "improved" and verdict["region"] != "measured")
    claim(ran.status == (0 if good else 3), f"status {ran.status} beside {status}, {verdict['region']}")
    claim(WORDS[status] in said, "the word of the verdict is missing")
    if status in ("refused", "not_improved"):
        claim("times smaller" not in said, "praise beside a verdict that is none")
        claim("Use the corrected model" not in said, "an advice to use what is not proven")
        claim("IMPROVED" not in said.replace("NOT IMPROVED", ""), "improved beside another word")
    else:
        claim("keep the nominal" not in said.lower() and "Do not use" not in said, "an advice against a proven gain")
    # Numbers that are told twice.
    stages = document["residuals"]
    stages = stages[0] if isinstance(stages, list) else stages
    unseen = next(((n, stages[n]) for n in UNSEEN if stages.get(n)), None)
    gain = by.get("gain-proven") or by.get("gain-not-proven") or by.get("gain-anyway")
    if unseen and gain:
        before = stages[f"{unseen[0]}_before"]["mean"]
        claim(
            abs(before - unseen[1]["mean"] - amount(gain["gain"])) < 6e-3 * max(before, unseen[1]["mean"]),
            f"the gain is {amount(gain['gain'])}, the table has {before} and {unseen[1]['mean']}",
        )
        if gain.get("low") is not None:
            claim(amount(gain["low"]) <= amount(gain["gain"]) <= amount(gain["high"]), "a gain outside its interval")
            claim("gain-proven" not in by or amount(gain["low"]) > 0, "a proven gain whose interval holds nought")
    # What a robust loss weighs down is left as well, and `left` is of the fit that was proven: most of the rows.
    robust = document["provenance"]["options"].get("loss", "none") != "none"
    mm = [] if robust else [g for g in document["fit"]["groups"] if g["unit"] == "mm"]
    rms = {g["name"]: (g["rms"], g["sigma"]) for g in mm}
    for r in (*reasons, *remarks):
        told = r["numbers"].get("left")
        if r["code"] in ("left", "above-stated-noise", "below-stated-noise", "computed") and told["unit"] == "mm":
            near = 0.1 if r["code"] == "left" else 5e-3
            known = rms.get(r["numbers"]["group"], (amount(told),))
            claim(
                any(same(v, amount(told), near) for v in known),
                f"{r['code']}: another residual than the table of sensors",
            )
    # The range of the claim.
    holds = document.get("working_range") or {}
    if status == "improved" and verdict["region"] == "working" and holds.get("band") is not None:
        claim(amount(holds["band"]) <= amount(holds["moved"]), "off by more than it corrects, and claimed there")
    other = by.get("elsewhere")
    if status == "improved" and verdict["region"] == "working" and other and holds.get("moved") is not None:
        if other["region"] == holds["name"]:
            claim(
                amount(other["mean"]) < 3 * amount(holds["moved"]),
                f"elsewhere {amount(other['mean'])} where {amount(holds['moved'])} is corrected",
            )
        else:
            claim(
                "the verdict is of" in next(r["sentence"] for r in remarks if r["code"] == "elsewhere"),
                "another range than that of the verdict, unsaid",
            )
    # Advice of one screen.
    advice = " ".join(r["advice"] for r in (*reasons, *remarks))
    claim(document["robot"]["joints"] or "--groups" not in advice, "groups of an arm for a robot without joints")
    claim(not ("few-unseen" in by and "gain-proven" in by), "too few to prove, and proven")
    claim(not ("above-stated-noise" in by and "below-stated-noise" in by and len(rms) < 2), "more and less than stated")
    sentences = [r["sentence"] for r in (*reasons, *remarks)]
    claim(len(sentences) == len(set(sentences)), "a sentence is told twice")
    # One result in three places.
    plain = " ".join(html.unescape(re.sub(r"<[^>]*>", " ", page)).split())
    for r in (*reasons, *(r for r in remarks if r["code"] != "elsewhere")):
        # A terminal breaks lines at the hyphens of a path too.
        words = "".join(r["sentence"].split())
        claim(words in "".join(said.split()), f"not on the terminal: {words}")
        claim(words in "".join(plain.split()), f"not in the report: {words}")
    for text in (said, plain, json.dumps(document)):
        one = re.search(
            r"(?<![\w.,-])1 (rows|joints|configurations|cables|poses|measurements|parameters|places|folds|points)\b",
            text,
        )
        claim(one is None, one and text[max(one.start() - 40, 0) : one.end() + 40])
        spoken = re.sub(r'"(band-)?profiled"', "", text)
        claim(not re.search(r"\bprofiled\b|stay where they began", spoken), "jargon")
    claim(not re.search(r"nan\b|None\b", said), "a number that is none")
    return found


def screen(folder, kind, name, seed):
    files = made(folder, kind, name, seed)
    run = folder / "run"
    ran = robocal("identify", *files, "-o", run)
    if ran.status == 2:
        return []
    document = json.loads((run / "result.json").read_text(encoding="utf-8"))
    return contradictions(ran, document, (run / "report.html").read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    ("kind", "name"), [e if e[1] in QUICK else pytest.param(*e, marks=pytest.mark.slow) for e in EVERY]
)
def test_no_two_sentences_contradict_each_other(kind, name, tmp_path):
    for seed in range(4 if FULL else 1):
        place = tmp_path / str(seed)
        place.mkdir()
        assert not screen(place, kind, name, seed)


def test_a_contradiction_is_found(tmp_path):
    """The same result with another verdict, another gain, and a remark less on its page."""
    run = tmp_path / "run"
    ran = robocal("identify", *arm(tmp_path), "-o", run)
    document, page = json.loads((run / "result.json").read_text()), (run / "report.html").read_text()
    assert not contradictions(ran, document, page)
    other = json.loads(json.dumps(document))
    other["verdict"]["status"] = "not_improved"
    assert len(contradictions(ran, other, page)) >= 3
    other = json.loads(json.dumps(document))
    other["verdict"]["remarks"][0]["numbers"]["gain"]["value"] *= 1.1
    assert contradictions(ran, other, page) and contradictions(ran, document, "<p>nothing</p>")
