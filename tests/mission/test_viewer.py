"""What the viewer of recordings is started with."""

import subprocess
import sys

from mission.view import open_viewer


def test_the_viewer_listens_on_loopback_only_and_tells_nobody(monkeypatch, tmp_path):
    started = []

    def run(command, *, env, check):
        started.append((command, env["RERUN_ANALYTICS"]))
        return subprocess.CompletedProcess(command, 0)

    monkeypatch.setattr(subprocess, "run", run)
    recording = tmp_path / "recording.rrd"
    assert open_viewer(recording) == 0
    assert started == [([sys.executable, "-m", "rerun", "--bind", "127.0.0.1", str(recording)], "false")]
