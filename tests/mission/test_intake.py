"""What is pushed into a flight: read like a mission file, merged, answered."""

import json
import re
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from mission.findings import InputError
from mission.flying import intake as intake_module
from mission.flying.intake import INBOX, LARGEST_BYTES, Intake, Push, mixed, push_into, read_push, with_push
from mission.loading import load
from mission.site.problem import problem_from_mission
from planner.information import DensityGrid

SPHERE = {"kind": "sphere", "center_enu_m": [100.0, 100.0, 40.0], "radius_m": 15.0}


@pytest.fixture
def mission(sound):
    return load(sound)


def read(mission, tmp_path, data):
    return read_push("push.json", json.dumps(data), mission, tmp_path)


def test_an_obstacle_is_read_and_merged(mission, tmp_path):
    push = read(mission, tmp_path, {"obstacle": [SPHERE]})
    problem = problem_from_mission(mission)
    place = np.array([[100.0, 100.0, 40.0]])
    assert problem.obstacles.distance(place)[0] > 0.0
    merged, learned = with_push(mission, problem, push)
    assert learned.obstacles.distance(place)[0] == pytest.approx(-15.0)
    assert len(merged.obstacle) == len(mission.obstacle) + 1
    # Information inside the obstacle is of no use.
    cell = np.floor((place[0] - [0.0, 0.0, 20.0]) / learned.information.cell_m).astype(int)
    assert learned.information.mass[tuple(cell)] == 0.0


def test_a_geodetic_position_lands_where_it_belongs(mission, tmp_path):
    sphere = {"kind": "sphere", "center_lla_deg_m": [47.3977, 8.5456, 528.0], "radius_m": 5.0}
    (entry,) = read(mission, tmp_path, {"obstacle": [sphere]}).obstacle
    assert entry.center_enu_m == pytest.approx((0.0, 0.0, 40.0), abs=1e-6)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ({}, "holds nothing"),
        ({"obstacel": [SPHERE]}, "obstacel: got [{ kind"),
        ({"obstacel": [SPHERE]}, "did you mean obstacle"),
        ({"foo": 1}, "known here are command, information, no_fly, obstacle, share"),
        ({"obstacle": [{"kind": "sphere", "radius_m": 1.0}]}, "write center_enu_m = [250, 250, 50]"),
        ({"obstacle": [SPHERE | {"radius_m": -1.0}]}, "radius_m"),
        ({"obstacle": [SPHERE | {"radius_m": float("nan")}]}, "radius_m"),
        ({"obstacle": [{"kind": "sphere"}]}, "center_enu_m"),
        ({"command": "explode"}, "command"),
        ({"information": {"kind": "uniform"}, "share": 2.0}, "share"),
        ({"information": {"kind": "raster", "raster": "nowhere.npy", "cell_m": 30.0}}, "nowhere.npy"),
        ([1, 2], "must be an object"),
    ],
)
def test_what_cannot_be_used_is_refused_with_what_to_mend(mission, tmp_path, data, words):
    with pytest.raises(InputError) as caught:
        read(mission, tmp_path, data)
    assert words in "; ".join(map(str, caught.value.findings))


def test_the_examples_of_the_page_can_be_pushed(mission, tmp_path):
    page = (Path(__file__).parents[2] / "docs" / "pushing.md").read_text(encoding="utf-8")
    examples = re.findall(r"```json\n(.*?)```", page, re.DOTALL)
    assert len(examples) == 4
    for example in examples:
        read_push("example", example, mission, tmp_path)
    assert all(f"| `{entry}` |" in page for entry in Push.model_fields)


def test_broken_json_is_refused(mission, tmp_path):
    with pytest.raises(InputError, match="not valid JSON"):
        read_push("push.json", '{"obstacle": [', mission, tmp_path)


def test_a_number_of_thousands_of_digits_is_refused(mission, tmp_path):
    with pytest.raises(InputError, match="not valid JSON"):
        read_push("push.json", '{"share": 1' + "0" * 5000 + "}", mission, tmp_path)


def test_new_information_replaces_what_was_known_or_is_mixed_with_it(mission, tmp_path):
    problem = problem_from_mission(mission)
    gaussian = {"kind": "gaussians", "component": [{"mean_enu_m": [450.0, 450.0, 40.0], "std_m": [10.0, 10.0, 10.0]}]}
    _, replaced = with_push(mission, problem, read(mission, tmp_path, {"information": gaussian}))
    _, shared = with_push(mission, problem, read(mission, tmp_path, {"information": gaussian, "share": 0.25}))
    for learned, least, most in ((replaced, 0.9, 1.0), (shared, 0.2, 0.3)):
        north_east = learned.information.centers_m()[..., :2].min(axis=-1) > 400.0
        assert least <= learned.information.mass[north_east].sum() <= most


def test_grids_of_different_size_are_mixed_on_the_finer_cells(mission):
    problem = problem_from_mission(mission)
    workspace = problem.workspace
    coarse = DensityGrid(workspace, np.array([[[1.0]], [[3.0]]]))
    fine = DensityGrid(workspace, np.ones((4, 6, 1)))
    both = mixed(coarse, fine, 0.5)
    assert both.mass.shape == (4, 6, 1)
    assert both.mass[:2].sum() == pytest.approx(0.5 * 0.25 + 0.5 * 0.5)


def test_a_flight_answers_every_push_once(mission, tmp_path):
    intake = Intake(tmp_path, mission)
    (tmp_path / INBOX / "a.json").write_text(json.dumps({"obstacle": [SPHERE]}))
    (tmp_path / INBOX / "b.json").write_text("nonsense")
    (tmp_path / INBOX / "c.json").write_text(" " * (LARGEST_BYTES + 1))
    good, bad, large = intake.arrived()
    assert good.push is not None
    assert bad.push is None
    assert "not valid JSON" in bad.reason
    assert "larger" in large.reason
    assert intake.arrived() == []
    intake.answer(good, True, "taken in")
    assert json.loads((tmp_path / INBOX / "a.answer").read_text()) == {"accepted": True, "reason": "taken in"}
    # A flight that is resumed does not take it in again as news.
    assert [one.name for one in Intake(tmp_path, mission).arrived()] == ["b", "c"]


def test_pushing_waits_for_the_answer(mission, tmp_path):
    intake = Intake(tmp_path, mission)
    file = tmp_path / "crane.json"
    file.write_text(json.dumps({"obstacle": [SPHERE]}))

    def fly():
        until = time.monotonic() + 5.0
        while time.monotonic() < until:
            for arrived in intake.arrived():
                intake.answer(arrived, True, "taken in")
                return
            time.sleep(0.01)

    flight = threading.Thread(target=fly)
    flight.start()
    assert push_into(tmp_path, file, 5.0) == {"accepted": True, "reason": "taken in"}
    flight.join()


def test_where_nobody_flies_nobody_answers(mission, tmp_path):
    Intake(tmp_path, mission)
    file = tmp_path / "crane.json"
    file.write_text("{}")
    assert push_into(tmp_path, file, 0.1) is None
    # What nobody took is not left for a later flight.
    assert list((tmp_path / INBOX).iterdir()) == []


def test_a_push_that_was_taken_cannot_be_withdrawn_any_more(mission, tmp_path, monkeypatch):
    intake = Intake(tmp_path, mission)
    file = tmp_path / "wish.json"
    file.write_text('{"command": "land"}')
    monkeypatch.setattr(intake_module, "_LOOKED_AT_S", 0.1)

    def take(folder, timeout_s):
        assert [one.push.command for one in intake.arrived() if one.push] in (["land"], [])

    monkeypatch.setattr(intake_module, "_answer_to", take)
    answer = push_into(tmp_path, file, 0.1)
    assert answer is not None
    assert not answer["accepted"]
    assert "took it" in answer["reason"]


def test_what_was_wanted_of_an_earlier_flight_is_not_done_in_this_one(mission, tmp_path):
    inbox = tmp_path / INBOX
    inbox.mkdir()
    (inbox / "a.json").write_text('{"command": "land"}')
    (inbox / "b.json").write_text(json.dumps({"command": "land", "obstacle": [SPHERE]}))
    (inbox / "c.taken").write_text('{"command": "return"}')
    intake = Intake(tmp_path, mission)
    (inbox / "d.json").write_text('{"command": "land"}')
    wish, crane, taken, news = intake.arrived()
    assert wish.push is None
    assert "earlier flight" in wish.reason
    assert crane.push is not None
    assert crane.push.command is None
    assert len(crane.push.obstacle) == 1
    assert taken.push is None
    assert news.push is not None
    assert news.push.command == "land"


def test_a_folder_that_is_no_flights_is_refused(tmp_path):
    with pytest.raises(InputError, match="inbox"):
        push_into(tmp_path, tmp_path / "crane.json", 0.1)
