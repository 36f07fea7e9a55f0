"""Faults as people write them."""

import dataclasses
import json
import re
import typing
from pathlib import Path

import pytest

from sim_bridge.faults import (
    AnyFault,
    BadLine,
    GpsGlitch,
    LinkCut,
    PilotSwitch,
    Reboot,
    WindChange,
    parse_fault,
    read_faults,
)
from sim_bridge.state import FlightMode


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("link-cut@30+5", LinkCut(begin_s=30.0, duration_s=5.0)),
        ("bad-line@0 loss=0.2 delay_s=0.2 jitter_s=0.1", BadLine(begin_s=0.0, loss=0.2, delay_s=0.2, jitter_s=0.1)),
        ("gps-glitch@30+10 offset_ned_m=[5,0,-1]", GpsGlitch(begin_s=30.0, duration_s=10.0, offset_ned_m=(5, 0, -1))),
        ('pilot@12.5 mode="hold"', PilotSwitch(begin_s=12.5, mode=FlightMode.HOLD)),
        ("reboot@8 recovers_in_air=false system=2", Reboot(begin_s=8.0, recovers_in_air=False, system=2)),
    ],
)
def test_a_fault_is_read_from_the_command_line(text, fault):
    assert parse_fault(text) == fault


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("link-cut", "KIND@BEGIN"),
        ("earthquake@3", "bad-line"),
        ("bad-line@3 loss=1.5", "share from 0 to 1"),
        ("bad-line@3 los=0.5", "los"),
        ("gps-glitch@3", "offset_ned_m"),
        ("reboot@3+5", "duration_s"),
        ("battery@3 charge=nan", "charge"),
        ("wind@3+0", "positive"),
        ("wind@3 mean_ned_mps=[1,2]", "mean_ned_mps"),
    ],
)
def test_what_is_no_fault_is_refused_with_the_reason(text, words):
    with pytest.raises(ValueError, match=words.replace("[", r"\[")):
        parse_fault(text)


def test_a_file_of_faults_is_read_in_toml_and_json(tmp_path):
    expected = [LinkCut(begin_s=3.0, duration_s=4.0), WindChange(begin_s=5.0, mean_ned_mps=(1.0, 2.0, 0.0))]
    toml, as_json = tmp_path / "faults.toml", tmp_path / "faults.json"
    toml.write_text(
        '[[fault]]\nkind = "link-cut"\nbegin_s = 3.0\nduration_s = 4.0\n'
        '[[fault]]\nkind = "wind"\nbegin_s = 5.0\nmean_ned_mps = [1.0, 2.0, 0.0]\n'
    )
    tables = [
        {"kind": "link-cut", "begin_s": 3.0, "duration_s": 4.0},
        {"kind": "wind", "begin_s": 5.0, "mean_ned_mps": [1.0, 2.0, 0.0]},
    ]
    as_json.write_text(json.dumps({"fault": tables}))
    assert read_faults(toml) == read_faults(as_json) == expected


def test_a_bad_file_of_faults_names_every_mistake_at_once(tmp_path):
    path = tmp_path / "faults.toml"
    path.write_text('[[fault]]\nkind = "link-cut"\nbegin_s = -1.0\n[[fault]]\nkind = "wind"\n')
    with pytest.raises(ValueError, match=r"(?s)fault 1.*from 0 s on.*fault 2.*begin_s"):
        read_faults(path)
    path.write_text("fault = 3")
    with pytest.raises(ValueError, match=r"must hold a list"):
        read_faults(path)
    path.write_text("[[fault]")
    with pytest.raises(ValueError, match="cannot be read"):
        read_faults(path)


def test_the_page_on_the_vehicle_names_every_fault_and_its_keys():
    page = (Path(__file__).parents[2] / "docs" / "simulator.md").read_text()
    for kind in typing.get_args(AnyFault):
        fields = {field.name: field for field in dataclasses.fields(kind)}
        (row,) = [line for line in page.splitlines() if line.startswith(f"| `{fields['kind'].default}` |")]
        named = set(re.findall(r"`(\w+)`", row.split("|")[2]))
        own = fields.keys() - {"kind", "begin_s", "system", "duration_s"}
        assert own <= named, f"{kind.__name__}: {own - named} missing"
