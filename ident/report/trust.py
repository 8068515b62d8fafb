"""How far a result can be trusted, in front of what it says."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from ident.report.page import Verdict


def with_trust(verdict: Verdict, content: Mapping[str, Any], field: str = "verdict") -> Verdict:
    """A page's verdict behind what the checks of the recordings found.

    Args:
        verdict: what the result says.
        content: of the result file.
        field: that holds `trustworthy` or `doubtful`; without it the verdict stays as it is.
    """
    if field not in content:
        return verdict
    sentences = [r["sentence"] for r in content["remarks"]]
    if content[field] == "trustworthy":
        return replace(verdict, more=[*verdict.more, *sentences])
    return Verdict("warning", content[field], sentences[0], [
        *sentences[1:], verdict.sentence, *verdict.more,
    ])  # fmt: skip
