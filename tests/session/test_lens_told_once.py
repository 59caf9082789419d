"""A lens that views contradict is told once, however many ways found it."""

from __future__ import annotations

import pytest

from robocal.prove.verdict import Verdict
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.session.vision.hand_eye_remarks import tell_lens

OTHER = Remark.of(Code.HAND_EYE_NOT_CONVERGED)


def lens(*names, z=5.0):
    return Remark.of(Code.LENS_CONTRADICTED, names=names, z=z)


@pytest.mark.parametrize("material", [True, False])
def test_two_ways_make_one_remark(material):
    """The numbers as the views alone tell them, with the largest z; without these, all that a fit tells."""
    before = Verdict("not_improved", (OTHER, lens("fx 900 given, 960 found", z=9.0), lens("k1 0 given, -0.2 found")))
    verdict, said, _ = tell_lens(before, lens("fx 900 given, 955 found", "cx 640 given, 660 found"), material)
    every = [r for r in (*verdict.reasons, *said) if r.code == Code.LENS_CONTRADICTED]
    names = ("fx 900 given, 955 found", "cx 640 given, 660 found")
    assert every == [lens(*names, z=9.0)] and OTHER in verdict.reasons and verdict.status == "not_improved"
    verdict, said, _ = tell_lens(before, None, False)
    assert verdict.reasons == (OTHER, lens("fx 900 given, 960 found", "k1 0 given, -0.2 found", z=9.0)) and not said


def test_what_one_way_tells_stays():
    good = Verdict("located", (OTHER,))
    assert tell_lens(good, None, False) == (good, [], False)
    assert tell_lens(good, lens("cx"), False) == (good, [lens("cx")], False)
    verdict, said, _ = tell_lens(good, lens("cx"), True)
    assert verdict == Verdict("not_improved", (lens("cx"), OTHER)) and not said
