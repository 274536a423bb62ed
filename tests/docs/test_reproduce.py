"""The page of Table A: the program's own table of all seeds, and what was trained."""

import importlib.util
from pathlib import Path

import pytest

PAGE = Path(__file__).resolve().parents[2] / "docs" / "reproduce.py"


@pytest.fixture
def page():
    spec = importlib.util.spec_from_file_location("reproduce", PAGE)
    page = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(page)
    return page


def test_the_table_is_the_program_s_with_the_seeds_of_a_method_in_one_row(page, monkeypatch):
    asked = []

    def reviewer(words):
        asked.append(words)
        return "| Method | pairs |\n"

    monkeypatch.setattr(page, "reviewer", reviewer)
    monkeypatch.setattr(page, "_minutes", lambda name: 20.0 if name.endswith("seed1") else 15.0)
    lines = page.table().splitlines()
    assert "--table-a" in asked[0] and "--repeat CSCDNet=cscdnet,cscdnet-seed1" in asked[0]
    mask = "'CSCDNet + Siamese attention mask=cscdnet-attention,cscdnet-attention-seed1'"
    assert f"--repeat {mask}" in asked[0]
    assert lines[0] == "| Method | pairs |"
    assert "| DR-TANet | width 0.25, 3000 iterations | 24000 | 15.0 min, 20.0 min |" in lines


def test_every_method_is_trained_once_a_seed(page):
    assert set(page.TRAININGS) == {
        f"{method}{seed}" for method in page.METHODS for seed in ("", "-seed1")
    }
    assert page.TRAININGS["cscdnet-seed1"].endswith("--seed 1")
