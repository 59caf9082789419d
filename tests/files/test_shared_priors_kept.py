"""covariance.json keeps a prior that several numbers share: what is read says of every one what was written."""

from __future__ import annotations

import json

import numpy as np
import pytest

from robocal.errors import FormatError
from robocal.estimate.uncertainty import Total
from robocal.files.covariance import Knowledge, covariance_text, read_covariance

NAMES = ("a", "b", "c")


def told(root: np.ndarray | None) -> Knowledge:
    rng = np.random.default_rng(0)
    half = rng.normal(size=(3, 3))
    total = Total(
        NAMES, half @ half.T, -np.eye(3) + 0.1 * rng.normal(size=(3, 3)), np.array([0.1, 0.2, 0.3]), root=root
    )
    return Knowledge(total, dict.fromkeys(NAMES, 1.0), dict.fromkeys(NAMES, 0.0))


def test_what_is_shared_is_read_as_it_was_written(tmp_path):
    place = tmp_path / "covariance.json"
    for root in (None, np.linalg.cholesky(np.array([[0.01, 0.015, 0.0], [0.015, 0.04, -0.02], [0.0, -0.02, 0.09]]))):
        known = told(root)
        place.write_text(covariance_text(known, dict.fromkeys(NAMES, "m")), encoding="utf-8")
        read = read_covariance(place).total
        np.testing.assert_allclose(read.covariance, known.total.covariance, rtol=1e-12)
        np.testing.assert_allclose(read.hidden, known.total.hidden, rtol=1e-12)
        assert ("root" in json.loads(place.read_text(encoding="utf-8"))) == (root is not None)


def test_a_root_that_is_not_theirs_is_refused(tmp_path):
    place = tmp_path / "covariance.json"
    known = json.loads(covariance_text(told(np.diag([0.1, 0.2, 0.3])), dict.fromkeys(NAMES, "m")))
    for root, words in (
        ([[1.0, 0, 0], [0, 1, 0], [0, 0, 1]], "noise and response"),
        ([[1.0, 0], [0, 1]], "wrong number of values"),
    ):
        place.write_text(json.dumps(known | {"root": root}), encoding="utf-8")
        with pytest.raises(FormatError, match=words):
            read_covariance(place)
