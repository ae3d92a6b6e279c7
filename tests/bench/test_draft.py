"""The report on draft and load: its comparisons hold what the manual says of them."""

import json
import sys

import pytest

from dirt_env.bench import draft


def test_the_wedge_is_near_the_tables_of_curved_planes_while_the_wall_is_smooth():
    for row in draft.passive_pressure():
        off = row["plane"] / row["curved"] - 1
        assert abs(off) < 0.025 if row["share"] == 0.0 else -0.01 < off < 0.32
        assert row["share"] != 1 / 3 or off < 0.09


def test_machines_that_begin_to_cut_have_the_draft_of_the_equation():
    for row in draft.draft_against_depth():
        exact = dict(zip(draft.DEPTHS.round(2), row["equation_kn"], strict=True))
        assert row["machine_kn"] == pytest.approx([exact[depth] for depth in draft.CUTS], rel=1e-3)


def test_the_load_of_wide_blades_is_near_their_rating():
    rows = draft.load_against_width()
    assert [row["width"] for row in rows] == list(draft.WIDTHS)
    for row in rows[1:]:
        assert row["full"] == pytest.approx(row["rated"], rel=0.06)
        assert 1.3 < row["pile"]["field"] / row["pile"]["volume"] < 1.7


def test_draft_scales_between_the_square_of_cohesion_and_the_cube_of_weight():
    exponents = [row["exponent"] for row in draft.scales()]
    assert exponents[0] == pytest.approx(3.0)
    assert exponents == sorted(exponents, reverse=True)
    assert 2.0 < exponents[-1] < 2.1


@pytest.mark.slow
def test_the_command_writes_figures_and_a_picture(tmp_path, monkeypatch, capsys):
    pytest.importorskip("matplotlib")
    monkeypatch.setattr(sys, "argv", ["draft", "--out", str(tmp_path / "new")])
    draft.main()
    results = json.loads((tmp_path / "new" / "draft.json").read_text())
    assert set(results) == {"passive_pressure", "draft", "load", "scales"}
    assert (tmp_path / "new" / "draft.png").stat().st_size > 10_000
    assert "Caquot-Kérisel" in capsys.readouterr().out
