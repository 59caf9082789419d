"""Sentence and advice of a remark on the terminal, in a report and in a document: the same words, each in its place."""

from __future__ import annotations

import copy

from report.samples import improved, result

from robocal.cli.guard import complain
from robocal.cli.terminal import Terminal
from robocal.files.parts import RemarkPart as Kept
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark, full_text, remark_fields
from robocal.report.identified import report
from robocal.report.sections import Remarks, Section

SAID = Remark.of(Code.NO_DIAMETER)
FACT = Remark.of(Code.MOTIONS_OPEN, count=3)


def test_worth_knowing_has_advice_below_the_sentence(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "120")
    Terminal().draw([Section.of("Worth knowing", Remarks((SAID, FACT)))])
    lines = [line.rstrip() for line in capsys.readouterr().out.splitlines()]
    assert lines == ["Worth knowing", f"  {SAID.sentence}", f"    {SAID.advice}", f"  {FACT.sentence}"]
    Terminal().draw([Section.of("", Remarks((Kept.of(SAID),)))])
    assert SAID.advice in capsys.readouterr().out, "what result.json keeps is shown alike"


def test_in_a_file_no_line_ends_with_blanks(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "60")
    Terminal().draw([Section.of("Worth knowing", Remarks((SAID, FACT)))])
    assert all(line == line.rstrip() for line in capsys.readouterr().out.splitlines())


def test_a_warning_beside_a_document_says_what_to_do(capsys):
    terminal = Terminal(json=True)
    for said in (SAID, FACT):
        complain(full_text(said), kind="warning")
    terminal.draw([Section.of("Worth knowing", Remarks((SAID,)))])
    out, err = capsys.readouterr()
    assert out == "" and err == f"warning: {SAID.sentence}. {SAID.advice}\nwarning: {FACT.sentence}\n"


def test_the_report_has_advice_beside_the_warning():
    document, rows = copy.deepcopy(improved())
    page = report(result(document | remark_fields((SAID, FACT))), rows, None)
    assert (
        f'<li>{SAID.sentence} <span class="soft">{SAID.advice}</span></li>' in page
        and f"<li>{FACT.sentence}</li>" in page
    )


def test_a_report_of_an_earlier_version_has_sentences_alone():
    document, rows = copy.deepcopy(improved())
    page = report(result(document | {"warnings": ["old", "old"], "remarks": []}), rows, None)
    assert page.count("<li>old</li>") == 1
