"""A motor to be simulated, as a file describes it: what it truly is, how it is swept, and the ramp that tests a compensation. Keys carry
their units."""

from __future__ import annotations

import math
import os
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from robocal._record import record
from robocal.drives.cogging import Cogging
from robocal.errors import ModelError
from robocal.files.schema import FileModel, Version, validate
from robocal.files.text import InputFile, read_text
from robocal.files.yamlio import YamlDocument, parse
from robocal.simulation.motor.plant import MotorPlant
from robocal.simulation.motor.procedure import RampTest, SweepPlan

__all__ = ["DataSheet", "MotorSimulation", "read_motor_simulation"]

Positive = Annotated[float, Field(gt=0, lt=1e9)]
NotNegative = Annotated[float, Field(ge=0, lt=1e9)]
Number = Annotated[float, Field(gt=-1e9, lt=1e9)]
LONGEST = 2e8  # rows that a run may take: a minute


class CoggingModel(FileModel):
    """Amplitudes A and phases p of a sum of A cos(n a + p)."""

    orders_per_turn: list[Annotated[int, Field(ge=1, le=10_000)]]
    amplitudes_N_m: list[NotNegative]
    phases_rad: list[Number]


class FrictionModel(FileModel):
    """Numbers of LuGre's model; the width of the cogging's hysteresis is that between both directions."""

    coulomb_N_m: Positive
    breakaway_N_m: Positive
    stribeck_rad_s: Positive
    viscous_N_m_s: NotNegative = 0.0
    bristle_stiffness_N_m_rad: Positive
    bristle_damping_N_m_s: NotNegative | None = None
    position_hysteresis_deg: NotNegative = 0.0


class ControllerModel(FileModel):
    """Rate of controller and current loop, and the filter of the PID's derivative."""

    rate_Hz: Annotated[float, Field(ge=50, le=100_000)] = 1000.0
    derivative_filter_ms: NotNegative = 0.0


class SweepModel(FileModel):
    """The slow sweep, once with each proportional gain."""

    speed_deg_s: Positive = 3.0
    turns: Annotated[float, Field(gt=0, le=100)] = 2.0
    directions: Literal["both"] = "both"
    proportional_gain_N_m_rad: list[Positive]
    torque_noise_N_m: NotNegative = 0.0
    log_rate_Hz: Annotated[float, Field(gt=0, le=100_000)] = 100.0


class EscapeModel(FileModel):
    """Gains so low that the rotor runs away from them somewhere."""

    proportional_gain_N_m_rad: list[Positive]


class RampModel(FileModel):
    """The ramp, once with each PID: kp in N m/rad, ki in N m/(rad s), kd in N m s/rad."""

    speed_deg_s: Positive = 22.0
    pid: list[list[NotNegative]]
    warm_up_turns: Annotated[float, Field(ge=0, le=100)] = 3.0
    window_turns: Annotated[float, Field(gt=0, le=100)] = 1 / 6


class DataSheetModel(FileModel):
    """What the maker prints of the motor (the document's Table 1.1 and annex A), which nothing here is computed from."""

    model: str = ""
    rated_power_kW: Positive
    rated_torque_N_m: Positive
    rated_speed_rpm: Positive
    poles: Annotated[int, Field(ge=2, le=1000)]
    back_emf_V_per_krpm: Positive


class DrumModel(FileModel):
    """What the motor drives: a gear, and a drum."""

    gear_ratio: Positive
    drum_radius_mm: Positive


class MotorSimulationModel(FileModel):
    """motor.yaml of a motor to be simulated."""

    robocal: Version = 1
    kind: Literal["motor-simulation"] = "motor-simulation"
    name: str = "motor"
    rotor_inertia_kg_m2: Positive
    torque_constant_N_m_per_A: Positive
    current_limit_A: Positive | None = None
    cogging: CoggingModel
    friction: FrictionModel
    encoder_counts_per_turn: Annotated[int, Field(ge=0, le=1 << 30)] = 0
    controller: ControllerModel = ControllerModel.model_construct()
    identification: SweepModel
    escape_cases: EscapeModel | None = None
    data_sheet: DataSheetModel | None = None
    winch: DrumModel | None = None
    test_ramp: RampModel
    source: str = ""


@record
class DataSheet:
    """A maker's numbers in SI: rated power (W), torque (N m) and speed (rad/s), poles, and the back-EMF (V s/rad, rms between phases)."""

    model: str
    power: float
    torque: float
    speed: float
    poles: int
    back_emf: float

    @property
    def power_of_torque(self) -> float:
        """Torque times speed (W)."""
        return self.torque * self.speed

    @property
    def constant_of_back_emf(self) -> float:
        """The torque constant (N m per A rms) of a motor of three phases: P = 3 (U / sqrt 3) I = K w I."""
        return math.sqrt(3.0) * self.back_emf


@record
class MotorSimulation:
    """A motor, its sweep with the gains (N m/rad) to try, gains at which its rotor escapes, the ramp with the gains of each PID, its data
    sheet, and how far its drum winds cable per turn of the motor (m/rad), where these are known."""

    name: str
    plant: MotorPlant
    sweep: SweepPlan
    gains: tuple[float, ...]
    escapes: tuple[float, ...]
    ramp: RampTest
    controllers: tuple[tuple[float, float, float], ...]
    file: InputFile
    data_sheet: DataSheet | None = None
    drum: float | None = None


def read_motor_simulation(path: str | os.PathLike[str]) -> MotorSimulation:
    """Reads the file. Raises FileError or FormatError naming the key."""
    source = read_text(path)
    document = parse(source)
    said = validate(MotorSimulationModel, document)
    _check(said, document)
    friction, limit = said.friction, said.current_limit_A
    try:
        plant = MotorPlant(
            inertia=said.rotor_inertia_kg_m2,
            torque_constant=said.torque_constant_N_m_per_A,
            cogging=_cogging(said),
            coulomb=friction.coulomb_N_m,
            breakaway=friction.breakaway_N_m,
            stribeck_speed=friction.stribeck_rad_s,
            viscous=friction.viscous_N_m_s,
            bristle_stiffness=friction.bristle_stiffness_N_m_rad,
            bristle_damping=friction.bristle_damping_N_m_s,
            current_limit=math.inf if limit is None else limit,
            counts=said.encoder_counts_per_turn,
        )
    except ModelError as error:
        document.fail(error.message, ("friction", f"{error.key}_N_m"), found=error.found, expected=error.expected)
    period, sweep, ramp = 1 / said.controller.rate_Hz, said.identification, said.test_ramp
    return MotorSimulation(
        said.name,
        plant,
        SweepPlan(math.radians(sweep.speed_deg_s), sweep.turns, period, 1 / sweep.log_rate_Hz, sweep.torque_noise_N_m),
        tuple(sweep.proportional_gain_N_m_rad),
        tuple(said.escape_cases.proportional_gain_N_m_rad) if said.escape_cases else (),
        RampTest(
            math.radians(ramp.speed_deg_s),
            ramp.warm_up_turns,
            ramp.window_turns,
            period,
            1e-3 * said.controller.derivative_filter_ms,
        ),
        tuple((kp, ki, kd) for kp, ki, kd in ramp.pid),
        InputFile(source.path, source.sha256),
        _data_sheet(said.data_sheet),
        None if said.winch is None else 1e-3 * said.winch.drum_radius_mm / said.winch.gear_ratio,
    )


def _data_sheet(said: DataSheetModel | None) -> DataSheet | None:
    if said is None:
        return None
    rpm = 2 * math.pi / 60
    return DataSheet(
        said.model, 1e3 * said.rated_power_kW, said.rated_torque_N_m, said.rated_speed_rpm * rpm, said.poles,
        said.back_emf_V_per_krpm / (1e3 * rpm),
    )  # fmt: skip


def _cogging(said: MotorSimulationModel) -> Cogging:
    """The harmonics: A cos(n a + p) = A cos(p) cos(n a) - A sin(p) sin(n a)."""
    amplitude, phase = np.array(said.cogging.amplitudes_N_m), np.array(said.cogging.phases_rad)
    cosine, sine = amplitude * np.cos(phase), -amplitude * np.sin(phase)
    lag = math.radians(said.friction.position_hysteresis_deg) / 2
    return Cogging(tuple(said.cogging.orders_per_turn), tuple(cosine.tolist()), tuple(sine.tolist()), lag)


def _check(said: MotorSimulationModel, document: YamlDocument) -> None:
    """Raises FormatError for numbers that do not fit each other."""
    orders, sweep, ramp = said.cogging.orders_per_turn, said.identification, said.test_ramp
    for key in ("amplitudes_N_m", "phases_rad"):
        count = len(getattr(said.cogging, key))
        document.insist(
            count == len(orders),
            "not one number for each order",
            ("cogging", key),
            found=count,
            expected=str(len(orders)),
        )
    document.insist(
        len(set(orders)) == len(orders),
        "an order is given twice",
        ("cogging", "orders_per_turn"),
        found=orders,
        expected="each once",
    )
    for at, given in (
        (("identification", "proportional_gain_N_m_rad"), sweep.proportional_gain_N_m_rad),
        (("test_ramp", "pid"), ramp.pid),
    ):
        document.insist(given, "nothing to simulate", at, found=given, expected="a list of gains")
    for i, gains in enumerate(ramp.pid):
        document.insist(
            len(gains) == 3, "not the gains of a PID", ("test_ramp", "pid", i), found=gains, expected="kp, ki and kd"
        )
    rate = said.controller.rate_Hz
    for at, fine in ((("identification", "log_rate_Hz"), sweep.log_rate_Hz <= rate),):
        document.insist(
            fine, "the log is faster than the controller", at, found=sweep.log_rate_Hz, expected=f"at most {rate:g}"
        )
    for at, turns, speed in (
        (("identification", "speed_deg_s"), sweep.turns, sweep.speed_deg_s),
        (("test_ramp", "speed_deg_s"), ramp.warm_up_turns + ramp.window_turns, ramp.speed_deg_s),
    ):
        steps = 360 * turns / speed * max(rate, 1e4)
        document.insist(steps < LONGEST, "the run would take too long", at, found=speed, expected="a faster one")
