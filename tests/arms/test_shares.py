"""A joint that counts with others, for every convention: its value is q_j + sum_k c_k q_k, in poses, derivatives, files and offsets."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from arms.arm_samples import rows

from robocal.arms import catalog
from robocal.arms.chain import joint_offsets, with_offsets
from robocal.arms.conventions import CONVENTIONS, chain
from robocal.arms.conventions import rows as rows_of
from robocal.arms.denavit import to_denavit
from robocal.arms.joints import with_gains
from robocal.errors import FormatError, ModelError
from robocal.files.robot import describe, parse_robot
from robocal.files.text import Source
from robocal.files.urdf_into import urdf_text

SHARES = {"j2": 1.0, "j4": -0.5}


def pair(convention, rng):
    """An arm of four joints, and the same with a third joint that counts with others."""
    given = rows(convention, "RRRR", rng)
    return chain("a", convention, given), chain(
        "a", convention, [{**r, **({"with": SHARES} if i == 2 else {})} for i, r in enumerate(given)]
    )


def axis_values(q):
    out = q.copy()
    out[:, 2] += q[:, 1] - 0.5 * q[:, 3]
    return out


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_it_counts_with_the_others(convention, rng):
    plain, shared = pair(convention, rng)
    q = rng.uniform(-1, 1, (6, 4))
    np.testing.assert_allclose(shared.pose(q), plain.pose(axis_values(q)), atol=1e-12)
    assert shared.shares == {"j3": SHARES} and not plain.shares
    np.testing.assert_allclose(shared.without_shares().pose(q), plain.pose(q), atol=1e-15)
    step = 1e-6
    for i in range(4):
        ahead, back = (q + s * step * np.eye(4)[i] for s in (1, -1))
        numeric = (shared.pose(ahead) - shared.pose(back))[:, :3, 3] / (2 * step)
        np.testing.assert_allclose(shared.jacobian(q)[:, :3, i], numeric, atol=1e-8)
    freed = with_gains(shared)
    name, gain = "j3.gain", freed.table["j3.gain"].value
    ahead, back = (freed.with_values({name: gain + s * step}).pose(q)[:, :3, 3] for s in (1, -1))
    np.testing.assert_allclose(freed.parameter_jacobian(q, [name])[:, :3, 0], (ahead - back) / (2 * step), atol=1e-8)


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_it_is_written_and_read_again(convention, rng):
    _, shared = pair(convention, rng)
    q = rng.uniform(-1, 1, (6, 4))
    again = parse_robot(Source(Path("r.yaml"), describe(shared), "0"))
    np.testing.assert_allclose(again.chain.pose(q), shared.pose(q), atol=1e-9)
    assert rows_of(again.chain)[2]["with"] == SHARES
    table = to_denavit(shared)
    np.testing.assert_allclose(table.pose(q), shared.pose(q), atol=1e-9)
    with pytest.raises(ModelError, match="counts with another"):
        urdf_text(shared)


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_offsets_are_added_to_what_the_controller_shows(convention, rng):
    _, shared = pair(convention, rng)
    q, offsets = rng.uniform(-1, 1, (6, 4)), {f"j{i + 1}": v for i, v in enumerate((0.01, -0.02, 0.03, 0.04))}
    if len(shared.zeros) < 4:
        pytest.skip("joints without zeros")
    moved = with_offsets(shared, offsets)
    np.testing.assert_allclose(moved.pose(q), shared.pose(q + np.array(list(offsets.values()))), atol=1e-12)
    found = dict(joint_offsets(shared, {p.name: p.value for p in moved.table.rows}))
    assert found == pytest.approx(offsets, abs=1e-12)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [("{j9: 1}", "j9"), ("{j3: 1}", "j3"), ("2", "not a mapping"), ("{j2: x}", "not a finite number")],
)
def test_what_no_joint_counts_with_is_named(wrong, words):
    text = describe(catalog.get("ur10"))
    joint = catalog.get("ur10").joint_names[2]
    lines = [f"{s[:-1]}, with: {wrong}}}" if s.startswith("  - {name: " + joint) else s for s in text.splitlines()]
    with pytest.raises(FormatError, match=words):
        parse_robot(Source(Path("r.yaml"), "\n".join(lines).replace(joint, "j3") + "\n", "0"))
