"""How straight cables are, against what the cable-robot thesis prints: prints what was asked for and what is measured.

python scripts/cable_straightness.py DATA [--draws 200]    DATA: the folder with seeds/table_3_2.csv and seeds/motor_rope.yaml
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

from robocal.cables.rope import ELASTICITY, EXPONENT, WEIGHT, rope, strain
from robocal.cables.straightness import least_tension, level_excess, level_sag
from robocal.fit.options import Options
from robocal.measure.base import synthesise
from robocal.measure.data import Configurations, DataSet, Observations
from robocal.prove.decision import decide
from robocal.prove.results import parameter_results
from robocal.session.cable.load_fits import fit_loads

SPAN, WEIGHT_OF_SEED = 4.925, 0.122
TENSIONS = np.array([4.6, 10.4, 14.5, 18.6])
SAG, EXCESS = np.array([80.44, 35.57, 25.51, 19.89]), np.array([3.502, 0.685, 0.352, 0.214])  # mm


def say(asked: str, found: str, met: bool) -> bool:
    """One line."""
    print(f"{'met ' if met else 'OPEN'}  {asked:<64} {found}")
    return met


def catenary() -> bool:
    """The values of the level cable."""
    h, longer = (1e3 * f(SPAN, TENSIONS, WEIGHT_OF_SEED) for f in (level_sag, level_excess))
    off = max(np.abs(h / SAG - 1).max(), np.abs(longer / EXCESS - 1).max())
    told = f"h {np.round(h, 2).tolist()}, l_c - l {np.round(longer, 3).tolist()} mm; off by {100 * off:.2f} %"
    out = say("catenary, SEEDS C: h 80.44 35.57 25.51 19.89, 1 %", told, off < 0.01)
    stretch = 1e3 * SPAN * float(strain(100.0, 2.5e-5))
    out &= say("stretch 12.31 mm at 4925 mm and 100 N, 1 %", f"{stretch:.2f} mm", abs(stretch / 12.31 - 1) < 0.01)
    t = least_tension(lambda t: float(level_excess(SPAN, t, WEIGHT_OF_SEED)), 2e-4, 1.0)
    return out & say("3.7.2: at 20 N no more than 0.2 mm", f"0.2 mm from {t:.2f} N on", t < 20)


def table(data: Path, folder: Path) -> bool:
    """Table 3.2 and annex A, as a person would give them."""
    said = "robocal: 1\nkind: sag\nsag: {columns: [h_meas_mm], unit: mm}\ntension: {columns: [tau_N], unit: N}\n"
    said += "span: {value: 4925, unit: mm}\n"
    (folder / "sag.yaml").write_text(f"{said}file: {(data / 'seeds' / 'table_3_2.csv').resolve()}\n")
    force = 23.60 * 9.80665  # N, 1 % of the breaking force
    rows = "".join(f"{share * force:.1f},{10 * percent}\n" for share, percent in ((10, 0.46), (20, 0.70), (30, 0.96)))
    (folder / "annex.csv").write_text("tension [N],elongation [mm],length [m]\n" + rows.replace("\n", ",1\n"))
    (folder / "annex.yaml").write_text(
        "robocal: 1\nkind: elongation\nfile: annex.csv\noffset: {value: 0, unit: mm, free: false}\n"
    )
    (weight,) = fit_loads([folder / "sag.yaml"], WEIGHT_OF_SEED).fits
    w = weight.parameters[0]
    told = f"{w.identified:.4f} N/m, 95 % {w.interval[0]:.4f} to {w.interval[1]:.4f}"
    out = say(
        "Table 3.2: weight with its interval (weighed: 0.122 N/m)",
        told,
        w.interval[0] <= WEIGHT_OF_SEED <= w.interval[1],
    )
    found = fit_loads([folder / "annex.yaml"], elasticity=2.5e-5)
    for fit in (f for f in (found.constant, found.curve) if f is not None):
        numbers = ", ".join(
            f"{p.name} {p.identified:.4g} ({p.interval[0]:.4g} to {p.interval[1]:.4g})" for p in fit.parameters
        )
        missed = 1e2 * np.abs(fit.predicted - fit.measured).max()
        say(
            f"annex A, {fit.what}: not linear",
            f"{numbers} at {fit.rope.reference:.0f} N; misses up to {missed:.2f} % of length",
            True,
        )
    law = found.curve or found.constant
    low = float(law.rope.strain(100.0)) * 1e2
    say("annex A carried to 100 N, measured 0.25 % (3.7.2: too small)", f"{low:.3f} %", low < 0.25)
    return out


def draw(rng: np.random.Generator, exponent: float) -> tuple[DataSet, DataSet]:
    """Loads like those of figures 3.13 and 3.14: 12 sags read to 0.5 mm, 20 elongations of 2200 mm up to 130 N read to 0.05 mm."""
    t, pull = rng.uniform(4, 20, 12), rng.uniform(5, 130, 20)
    sags = Observations(
        "sag",
        np.arange(12),
        np.zeros((12, 1)),
        np.full((12, 1), 5e-4),
        extra={"span": np.full(12, SPAN), "tension": t},
        group="sag",
    )
    longer = Observations(
        "elongation", np.arange(20), np.zeros((20, 1)), np.full((20, 1), 5e-5), extra={"length": np.full(20, 2.2), "tension": pull},
        options={"offset": "gauge"}, group="gauge",
    )  # fmt: skip
    truth = rope(WEIGHT_OF_SEED, 2.5e-5, exponent, 50.0)
    return tuple(
        synthesise(truth, DataSet(Configurations(tuple(map(str, range(len(o))))), (o,)), rng) for o in (sags, longer)
    )


def coverage(draws: int) -> bool:
    """How often 95 % intervals hold the truth."""
    inside: dict[str, list[bool]] = {}
    for seed in range(draws):
        exponent = 0.7 if seed % 2 else 1.0
        sags, longer = draw(np.random.default_rng(seed), exponent)
        free = (ELASTICITY, EXPONENT) if exponent != 1.0 else (ELASTICITY,)
        for data, names, truth in ((sags, (WEIGHT,), WEIGHT_OF_SEED), (longer, free, 2.5e-5)):
            made = decide(rope(0.1, 2e-5, 1.0, 50.0, names), data, Options())
            for p in parameter_results(made):
                if p.interval is not None and p.name in names:
                    true = exponent if p.name == EXPONENT else truth
                    inside.setdefault(p.name, []).append(p.interval[0] <= true <= p.interval[1])
    total = [i for v in inside.values() for i in v]
    told = ", ".join(f"{n} {100 * np.mean(v):.1f} % of {len(v)}" for n, v in inside.items())
    share = float(np.mean(total))
    return say(
        f"95 % intervals hold the truth, 93 to 97 %, {draws} draws",
        f"{100 * share:.1f} %: {told}",
        0.93 <= share <= 0.97,
    )


def main(words: list[str]) -> int:
    """All of it; 0 where everything is met."""
    draws = int(words[words.index("--draws") + 1]) if "--draws" in words else 200
    met = catenary()
    with tempfile.TemporaryDirectory() as folder:
        met &= table(Path(words[0]), Path(folder))
    met &= coverage(draws)
    return 0 if met else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
