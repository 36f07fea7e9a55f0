"""Whatever stands in a mission file, it is refused with findings or it becomes a mission; nothing else happens."""

import copy
import tomllib

import hypothesis.strategies as st
from hypothesis import HealthCheck, given, settings

from mission.findings import InputError
from mission.loading import Document, mission_from_document
from mission.mission_file import Mission

JUNK = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(10**20), 10**20),
    st.floats(),
    st.text(max_size=5),
    st.just([]),
    st.just({}),
    st.dictionaries(st.text(max_size=3), st.integers(), max_size=2),
    st.lists(st.one_of(st.floats(), st.text(max_size=2)), max_size=4),
    st.just({"lla_deg_m": [47.0, 8.0, 500.0]}),
    st.sampled_from(["sphere", "uniform", "raster", "sim", "nan", "px4-quadrotor", "terrain", "/", ".", "\0"]),
    st.just([[0.0, 0.0], [100.0, 100.0], [100.0, 0.0], [0.0, 100.0]]),
)


def places(value, path=()):
    """Every path into nested tables and lists."""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, entry in inner:
        yield (*path, key)
        yield from places(entry, (*path, key))


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_junk_in_any_place_is_refused_with_findings(data, sound, tmp_path):
    mission = copy.deepcopy(tomllib.loads(sound.read_text()))
    for _ in range(data.draw(st.integers(1, 3))):
        path = data.draw(st.sampled_from(sorted(places(mission), key=str)))
        place = mission
        for step in path[:-1]:
            place = place[step]
        key = data.draw(st.sampled_from([path[-1], "kind", "lla_deg_m"])) if isinstance(place, dict) else path[-1]
        place[key] = copy.deepcopy(data.draw(JUNK))
    findings = ()
    try:
        assert isinstance(mission_from_document(Document("junk.toml", tmp_path, mission)), Mission)
    except InputError as error:
        findings = error.findings
    assert all(finding.path and finding.advice and "pydantic" not in str(finding) for finding in findings)
