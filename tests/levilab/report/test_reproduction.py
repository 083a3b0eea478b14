"""How to reproduce a report: commands as one types them, hashes, seeds."""

from __future__ import annotations

import hashlib
import json
import shutil
from typing import TYPE_CHECKING

from levilab.cli.analyze import OPTIONS
from levilab.pipelines.catalogue import ANALYSES
from levilab.present.document.blocks import Code, Facts, Tabular
from levilab.report.reproduction import SAME_IN_COMMANDS, reproduction
from support.paths import SAMPLE_DATA

if TYPE_CHECKING:
    from pathlib import Path


def test_the_options_in_commands_are_those_of_the_command_line() -> None:
    assert set(SAME_IN_COMMANDS) <= OPTIONS.keys()
    assert all(OPTIONS[name].to in {"", name} for name in SAME_IN_COMMANDS)


def test_commands_hashes_seeds_and_what_recorded_it_are_there(tmp_path: Path) -> None:
    run = shutil.copytree(SAMPLE_DATA / "lower-limits", tmp_path / "a run")
    record = json.loads((run / "run.json").read_text(encoding="utf-8"))
    record |= {"seed": 7, "command_line": ["/usr/bin/levilab", "acquire", "limit", "--note", "it's"], "software": {}}
    (run / "run.json").write_text(json.dumps(record), encoding="utf-8")
    limit = ANALYSES["limit"]
    found = limit.analyze([run], limit.options_from({"reading_u": 0.06}))
    section = reproduction([(limit, found)])
    (code,) = (block for block in section.blocks if isinstance(block, Code))
    assert code.text.splitlines() == [
        f"levilab analyze limit '{run}' --reading-u 0.06",
        f"levilab report '{run}' -o report.html",
    ]
    (data,) = (block for block in section.blocks if isinstance(block, Tabular))
    digest = hashlib.sha256((run / "readings.csv").read_bytes()).hexdigest()
    assert [row.cells for row in data.table.rows] == [("a run", "readings.csv", "7", digest)]
    recorded = next(block for block in section.blocks if getattr(block, "title", "") == "Recorded by")
    (facts,) = recorded.blocks
    assert isinstance(facts, Facts)
    assert facts.facts[0].texts == ("""levilab acquire limit --note 'it'"'"'s'""",)
