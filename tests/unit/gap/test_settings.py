"""Settings: documented, in the README, in the result, and respected."""

import re
from pathlib import Path

import pytest
from pydantic import ValidationError

from ident.gap.options import Options
from ident.gap.settings import GapSettings, Scoring
from ident.model.setting_fields import table

README = Path(__file__).parents[3] / "ident" / "gap" / "README.md"


def test_the_table_in_the_readme_is_the_generated_one():
    assert table(GapSettings()) in README.read_text(encoding="utf-8")


def test_every_number_has_a_unit_and_a_reason():
    for section in GapSettings.model_fields:
        for key, info in type(getattr(GapSettings(), section)).model_fields.items():
            assert re.search(r"\[[^\]]+\]", info.description or ""), f"{section}.{key} has no unit"


def test_settings_are_frozen_and_checked():
    with pytest.raises(ValidationError, match="frozen"):
        GapSettings().scoring.max_effects = 3  # pyright: ignore[reportAttributeAccessIssue]
    with pytest.raises(ValidationError, match="less than or equal to 1"):
        Scoring(same_effect_share=1.5)
    with pytest.raises(ValidationError, match="Extra inputs"):
        GapSettings(scores=Scoring())  # pyright: ignore[reportCallIssue]


def test_the_result_repeats_them():
    content = Options(null_runs=2, settings=GapSettings(scoring=Scoring(max_effects=3))).content()
    assert (content["null_runs"], content["scoring"]["max_effects"]) == (2, 3)
    assert content["thresholds"]["min_gain"] == 0.04
