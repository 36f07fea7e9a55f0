from pathlib import Path

from mission.mission_file import Mission
from mission.mission_file_docs import document

PAGE = Path(__file__).parents[2] / "docs" / "mission_file.md"


def test_the_page_is_what_the_schema_says():
    assert PAGE.read_text(encoding="utf-8") == document(), (
        "write it again: python -m mission.mission_file_docs docs/mission_file.md"
    )


def test_every_section_is_on_the_page():
    page = document()
    for section in Mission.model_fields:
        assert section == "name" or f"[{section}]" in page
