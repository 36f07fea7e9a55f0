"""Only what passed the gate is proven, and only what is proven is selected."""

import copy
import dataclasses
import pickle

import numpy as np
import pytest

from planner.diversity import Diversity
from planner.gate import ProvenTrajectory, inspect, prove
from planner.plan import Candidate, Plan, Status
from planner.problem import Limits
from planner.trajectory import Trajectory
from tests.planner.judged_curves import problem_of, random_curve


@pytest.fixture
def curve() -> Trajectory:
    return random_curve(np.random.default_rng(11))


def test_only_the_gate_makes_a_proven_trajectory(curve: Trajectory) -> None:
    problem = problem_of(curve)
    proven = prove(curve, problem)
    assert proven.report.passed
    with pytest.raises(TypeError, match="which proves it"):
        ProvenTrajectory()
    with pytest.raises(TypeError, match="which proves it"):
        ProvenTrajectory(curve.control_points_m, curve.knot_interval_s)
    with pytest.raises(TypeError, match="prove the new one"):
        dataclasses.replace(proven, control_points_m=curve.control_points_m + 50.0)
    with pytest.raises(AttributeError, match="cannot assign"):
        proven.control_points_m = curve.control_points_m
    with pytest.raises(ValueError, match="read-only"):
        proven.control_points_m[3] += 50.0
    before = proven.control_points_m.copy()
    curve.control_points_m[5] += 50.0
    np.testing.assert_array_equal(proven.control_points_m, before)


def test_what_is_made_of_a_proven_trajectory_has_no_proof_but_for_the_same_at_another_time(curve: Trajectory) -> None:
    proven = prove(curve, problem_of(curve))
    for made in (proven.slowed(2.0), proven.from_knot(3)):
        assert type(made) is Trajectory
    later = proven.starting_at(7.0)
    assert isinstance(later, ProvenTrajectory)
    assert later.start_s == 7.0
    np.testing.assert_array_equal(later.control_points_m, proven.control_points_m)
    assert proven.start_s == curve.start_s


def test_a_proven_trajectory_that_comes_from_another_process_cannot_be_changed_either(curve: Trajectory) -> None:
    heading = np.linspace(0.0, 1.0, len(curve.control_points_m))
    proven = prove(dataclasses.replace(curve, heading_control_rad=heading), problem_of(curve))
    for copied in (pickle.loads(pickle.dumps(proven)), copy.deepcopy(proven)):
        assert isinstance(copied, ProvenTrajectory)
        np.testing.assert_array_equal(copied.control_points_m, proven.control_points_m)
        assert copied.report.max_speed_mps == proven.report.max_speed_mps
        for array in (copied.control_points_m, copied.heading_control_rad):
            assert array is not None
            with pytest.raises(ValueError, match="read-only"):
                array += 1.0


def test_a_candidate_is_proven_or_refused_and_only_a_proven_one_is_selected(curve: Trajectory) -> None:
    sound = problem_of(curve)
    proven, passed = prove(curve, sound), inspect(curve, sound)
    refusal = inspect(curve, dataclasses.replace(sound, limits=Limits(0.1, 1e4, 1e4, 1e4)))
    flown, refused = Candidate(proven, "made", 1.0, 1.0), Candidate(curve, "made", 0.5, 0.5, refusal)
    assert flown.feasible
    assert flown.proven is proven
    assert not refused.feasible
    with pytest.raises(ValueError, match="refused this candidate: speed"):
        _ = refused.proven
    for trajectory, report in ((curve, None), (curve, passed), (proven, refusal)):
        with pytest.raises(ValueError, match="proven trajectory, or any other"):
            Candidate(trajectory, "made", 1.0, 1.0, report)
    alike = Diversity(0.0, 0.0, 0.0, 1.0)
    assert Plan(Status.CONVERGED, (flown, refused), 0, 1.0, alike, 1).best is flown
    with pytest.raises(ValueError, match="refused by the gate"):
        Plan(Status.CONVERGED, (flown, refused), 1, 1.0, alike, 1)
