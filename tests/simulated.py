"""A true arm beside its model, and the files of a simulation of it."""

from __future__ import annotations

from robocal.session.simulated_robot import ArmSimulator
from robocal.session.simulator import LABEL, Request, true_model


def true_chain(chain, errors, rng):
    """The arm as it is said to be: perturbed geometry, then the values that were set."""
    return true_model(chain, chain.geometric, errors, rng)


def simulation_files(robot, truth, data, about):
    """The texts of a simulation: the nominal robot, the data with its frame unknown, and the truth."""
    simulator, label = ArmSimulator(robot, Request()), f"{LABEL}{about}\n"
    return {**simulator.robot_files(truth, label), **simulator.data_files(data, label)}
