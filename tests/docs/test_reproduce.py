"""The page of Table A: its table names both scopes, from what `evaluate --table-a` prints."""

import importlib.util
import json
from pathlib import Path

PAGE = Path(__file__).resolve().parents[2] / "docs" / "reproduce.py"


def test_the_table_has_both_scopes_by_name(monkeypatch):
    spec = importlib.util.spec_from_file_location("reproduce", PAGE)
    page = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(page)
    asked = []

    def reviewer(words):
        asked.append(words)
        return json.dumps([
            {"method": "difference", "DoI": variant, "run": page.DIFFERENCE, "pairs": 8,
             "mean": mean, "cs1": mean - 0.1, "hw1": mean + 0.1}
            for variant, mean in (("", 0.7), ("component", 0.8), ("image", 0.75))
        ])  # fmt: skip

    monkeypatch.setattr(page, "reviewer", reviewer)
    monkeypatch.setattr(page, "TITLES", {"difference": "difference (no training)"})
    lines = page.table().splitlines()
    assert "--table-a" in asked[0]
    assert lines[0].startswith("|  | without DoI | with DoI (component) | with DoI (image) |")
    assert lines[2] == "| difference (no training) | 0.7000 | 0.8000 | 0.7500 | - | - | - |"
    assert lines[-1] == "| difference (no training) | 0.60 / 0.70 / 0.65 | 0.80 / 0.90 / 0.85 |"
