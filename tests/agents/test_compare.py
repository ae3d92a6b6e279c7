"""The comparison: the tables say what was played, and goes on where it was stopped."""

import json

import pytest

pytest.importorskip("matplotlib")

from dirt_env.agents import compare
from dirt_env.agents.network import written

from .conftest import METADATA, weights


@pytest.fixture
def two(tmp_path, monkeypatch):
    """Instead of what is shipped two seeds, one that pushes and one that stands, and one more like the first."""
    names = []
    for name, speed in (("ppo_seed0", 0.4), ("ppo_seed1", 0.0), ("ppo_large", 0.4)):
        path = tmp_path / f"{name}.npz"
        path.write_bytes(written(weights(drive=(0.0, speed, 0.0)), METADATA))
        log = [
            "steps,seconds,level,volume_distance_m4_per_min",
            *(f"{n * 10},{n * 60.0},0,{0.1 * n}" for n in range(4)),
        ]
        path.with_suffix(".csv").write_text("\n".join(log) + "\n")
        names.append(str(path))
    monkeypatch.setattr(compare, "learned", lambda: tuple(names[:2]))
    monkeypatch.setattr(compare, "others", lambda: tuple(names[2:]))
    monkeypatch.setattr(compare, "SUITES", {"quick": ("idle",)})
    return names


@pytest.mark.slow
def test_it_plays_all_and_writes_tables_and_plots(two, tmp_path, capsys):
    docs, out = tmp_path / "docs", tmp_path / "out"
    docs.mkdir()
    marks = ("made-with", "quick", "quick-ratios")
    (docs / "results.md").write_text("\n".join(f"<!-- results:{mark} -->\n<!-- /results -->" for mark in marks))
    command = ["--out", str(out), "--layouts", "2", "--renew-docs", str(docs)]
    assert compare.main(command) == 0
    text = (docs / "results.md").read_text()
    means, ratios = text.split("<!-- results:quick-ratios -->")
    assert means.count("| PPO, all seeds |") == 2
    assert "| level | policy | over |" in ratios
    assert ratios.count("| PPO, all seeds | idle |") == ratios.count("ppo_large.npz | idle |") == 2
    assert "| 0 | idle | 0.0 [0.0, 0.0] |" in text
    assert "layouts: 2 of each level" in text
    played = [json.loads(line) for line in (out / "quick" / "episodes.jsonl").read_text().splitlines()[1:]]
    pushed = [row["metrics"]["share_end"] for row in played if row["policy"] == two[0] and row["level"] == 0]
    assert len(pushed) == 2
    of = {line.split(" | ")[1]: line.split(" | ")[2] for line in means.splitlines() if line.startswith("| 0 | ")}
    assert of[two[0]].startswith(f"{100 * sum(pushed) / 2:.1f} [")
    assert of[two[2]] == of[two[0]]  # it does the same
    assert of["PPO, all seeds"].startswith(f"{100 * sum(pushed) / 4:.1f} [")  # of both seeds, and of nothing else
    for name in ("quick", "learning"):
        assert (docs / "figures" / "results" / f"{name}.png").read_bytes()[:4] == b"\x89PNG"
    before = (out / "quick" / "episodes.jsonl").read_bytes()
    assert compare.main(command) == 0
    assert (out / "quick" / "episodes.jsonl").read_bytes() == before


def test_without_shipped_policies_it_says_what_is_needed(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(compare, "policy_names", lambda: ("idle",))
    assert compare.main(["--out", str(tmp_path)]) == 2
    assert "no trained policies are shipped; needed: agents/policies/ppo_seed0.npz" in capsys.readouterr().err


def test_a_wrong_folder_of_documents_is_refused_before_anything_is_played(two, tmp_path, capsys):
    assert compare.main(["--out", str(tmp_path / "out"), "--renew-docs", str(tmp_path / "nowhere")]) == 2
    assert "which has no results.md; allowed: the folder docs of a checkout" in capsys.readouterr().err
    assert not (tmp_path / "out" / "quick").exists()
