"""What the digits of a table carry."""

from __future__ import annotations

import numpy as np
import pytest

from robocal.files.csvtable import read_csv


def digits(tmp_path, text, columns, **how):
    path = tmp_path / "a.csv"
    path.write_text(text)
    return read_csv(path, **how).digits(columns)


def test_so_many_decimals(tmp_path):
    """Short numbers were cut where zeros were dropped, not rounded more coarsely."""
    np.testing.assert_allclose(digits(tmp_path, "a [mm],b [mm]\n221.4799,0\n-3.5,12\n", ["a", "b"]), 1e-4)


def test_so_many_significant_digits(tmp_path):
    found = digits(tmp_path, "a [mm],b [mm]\n221.4799,0.01234567\n-3.512345,1234567\n", ["a", "b"])
    np.testing.assert_allclose(found, [[1e-4, 1e-8], [1e-6, 1.0]])


def test_whole_numbers_exponents_and_decimal_commas(tmp_path):
    np.testing.assert_allclose(digits(tmp_path, "a [deg]\n30\n45\n", ["a"]), 1.0)
    np.testing.assert_allclose(digits(tmp_path, "a [m]\n1.25e-3\n2.51e-4\n", ["a"]), [[1e-5], [1e-6]])
    found = digits(tmp_path, "a [m];b [m]\n1,250;-0,001\n", ["a", "b"], separator=";", decimal=",")
    np.testing.assert_allclose(found, 1e-3)


@pytest.mark.parametrize("count", [6, 9, 15, 17])
def test_rounding_is_what_is_told(tmp_path, count, rng):
    """Numbers written with so many digits are off by at most half a unit of the last one told."""
    exact = rng.uniform(-1, 1, 300) * 10 ** rng.uniform(-3, 3, 300)
    written = [f"{v:.{count}g}" for v in exact]
    found = digits(tmp_path, "a [mm]\n" + "\n".join(written) + "\n", ["a"])[:, 0]
    off = np.abs(np.array([float(w) for w in written]) - exact)
    assert (off <= 0.5 * found * (1 + 1e-6) + 2e-16 * np.abs(exact)).all()
    if count < 15:
        assert np.sqrt(np.mean((off / found) ** 2)) == pytest.approx(1 / np.sqrt(12), rel=0.1)
