"""Pages: whole, self-contained, readable aloud, and true to the result files."""

import copy
import json
import math
import re
from dataclasses import replace
from itertools import pairwise
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from ident.effects.catalogue import catalogue
from ident.report.charts import row_chart
from ident.report.compare_page import Comparison, compare_page
from ident.report.design_page import DesignReport, design_page, used_share
from ident.report.figures import Trace
from ident.report.gap.page import gap_page
from ident.report.gap.report import GapReport
from ident.report.gap.words import verdict_sentences
from ident.report.page import (
    Figure,
    Page,
    Section,
    Table,
    Verdict,
    commands_as_code,
    render,
)
from ident.report.run_page import RunReport, run_page
from ident.report.style import AFTER
from ident.report.validate_page import validate_page
from ident.report.words import DASH, closed_text, number, percent, plus_minus

VOID = ("meta",)


@pytest.fixture(scope="session")
def pages(
    run_report: RunReport,
    validate_content: dict[str, Any],
    trace: Trace,
    gap_report: GapReport,
    design_report: DesignReport,
    run_content: dict[str, Any],
) -> dict[str, str]:
    return {
        "run": render(run_page(run_report)),
        "validate": render(validate_page(validate_content, (trace,))),
        "gap": render(gap_page(gap_report)),
        "design": render(design_page(design_report)),
        "compare": render(compare_page(Comparison(("old", "new"), (run_content, run_content)))),
    }


@pytest.fixture(params=["run", "validate", "gap", "design", "compare"])
def html(request: pytest.FixtureRequest, pages: dict[str, str]) -> str:
    return pages[request.param]


def without_code(html: str) -> str:
    return re.sub(r"<(script|style)\b.*?</\1>", " ", html, flags=re.DOTALL)


def tree(html: str) -> ElementTree.Element:
    """The page as XML, which it is but for doctype, code, and the elements that never close."""
    body = re.sub(r"<!doctype html>", "", without_code(html))
    for tag in VOID:
        body = re.sub(rf"<({tag}\b[^>]*)>", r"<\1/>", body)
    return ElementTree.fromstring(body)


def text_of(html: str) -> str:
    return " ".join(re.sub(r"<[^>]+>", " ", without_code(html)).split())


def charts_of(html: str) -> list[dict[str, Any]]:
    """What the page's script draws, as a browser reads it."""
    found = re.search(
        r'<script type="application/json" id="charts">(.*?)</script>', html, re.DOTALL
    )
    assert found
    return json.loads(found[1])


def test_every_element_is_closed_and_every_id_is_there_once(html: str) -> None:
    ids = [e.get("id") for e in tree(html).iter() if e.get("id")]
    assert len(ids) == len(set(ids))


def test_nothing_is_fetched(html: str) -> None:
    fetching = r"""(?:src|href)=["'](?!#)|url\(|@import|<link|fetch\(|XMLHttpRequest|import\("""
    assert re.findall(fetching, html) == []
    assert re.findall(r"https?://", without_code(html)) == []


def test_headings_follow_each_other_and_the_contents_lead_to_them(html: str) -> None:
    page = tree(html)
    levels = [int(e.tag[1]) for e in page.iter() if re.fullmatch(r"h\d", e.tag)]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(b - a <= 1 for a, b in pairwise(levels))
    ids = {e.get("id") for e in page.iter()}
    links = [e.get("href", "") for e in page.iter() if e.tag == "a"]
    assert links
    assert all(link.removeprefix("#") in ids for link in links)


def test_every_chart_has_a_place_words_and_units(html: str) -> None:
    charts = charts_of(html)
    assert charts
    places = [e for e in tree(html).iter() if e.get("data-chart")]
    assert [e.get("data-chart") for e in places] == [str(i) for i in range(len(charts))]
    for place, chart in zip(places, charts, strict=True):
        assert place.get("tabindex") == "0"
        assert re.search(r"\d", place.get("aria-label", ""))
        axes = [chart.get(k) for k in ("x_label", "y_label", "label")]
        axes += [panel["label"] for panel in chart.get("panels", [])]
        assert all(re.search(r"\[[^\]]+\]$", a) for a in axes if a)


def test_every_figure_has_a_caption_and_its_numbers(html: str) -> None:
    page = tree(html)
    figures = [e for e in page.iter() if e.tag == "figure"]
    assert figures
    for figure in figures:
        caption = figure.find("figcaption")
        assert caption is not None
        assert caption.find("strong") is not None
        assert figure.findall("./details//tbody/tr/td")


def test_every_table_has_heads(html: str) -> None:
    for table in (e for e in tree(html).iter() if e.tag == "table"):
        assert table.find("caption") is not None
        heads = [e for e in table.iter() if e.tag == "th"]
        assert {e.get("scope") for e in heads} == {"col", "row"}
        assert all(e.text for e in heads)
        columns = len(table.findall("./thead/tr/th"))
        assert all(len(row) == columns for row in table.findall("./tbody/tr"))


def test_every_page_says_what_to_do_next(html: str) -> None:
    last = [e for e in tree(html).iter() if e.tag == "section"][-1]
    assert last.findtext("h2") == "What to do next"
    commands = [e.text or "" for e in last.iter("code")]
    assert commands
    assert all(re.match(r"(ident|wamctl) \w+ ", c) for c in commands)


def test_provenance_is_folded_away(pages: dict[str, str]) -> None:
    for name in ("run", "validate", "gap", "design"):
        sections = {e.findtext("h2"): e for e in tree(pages[name]).iter("section")}
        folded = sections["Versions, settings, and times"].find("details")
        assert folded is not None
        assert folded.get("open") is None


def test_a_page_without_javascript_says_so(html: str) -> None:
    assert "need JavaScript" in (tree(html).findtext(".//noscript/p") or "")


def test_numbers_cannot_end_the_script() -> None:
    name = "</script><b>"
    chart = row_chart(name, "[1]", [name], {name: (AFTER, [1.0])})
    figure = Figure(name, name, [chart], Table(name, [name], [[name]]))
    page = render(Page("", "", Verdict("good", "", ""), [], [Section("s", [figure])]))
    assert charts_of(page)[0]["rows"] == [name]
    assert "<b>" not in page


def test_commands_in_a_sentence_are_set_as_code_and_names_stay_harmless() -> None:
    told = commands_as_code("Run `ident gap` on <b>log</b>.")
    assert told == "Run <code>ident gap</code> on &lt;b&gt;log&lt;/b&gt;."
    assert commands_as_code("a ` alone") == "a ` alone"


def test_joints_that_were_held_have_no_torque_figure(pages: dict[str, str]) -> None:
    joints = [e.get("data-joint") for e in tree(pages["run"]).iter() if e.get("data-joint")]
    assert joints == ["1 base", "2 lift", "1 base"]


def test_slow_samples_are_shown_and_marked(run_report: RunReport, trace: Trace) -> None:
    chart = charts_of(render(run_page(run_report)))[1]
    measured, predicted = (s["y"] for s in chart["panels"][0]["series"])
    assert None not in measured
    assert None not in predicted
    assert chart["panels"][1]["series"][0]["minus"] == [0, 1]
    inside = np.zeros(len(trace.t), dtype=bool)
    for start, end in chart["shaded"]:
        inside |= (trace.t >= start) & (trace.t <= end)
    assert np.mean(inside == ~trace.counted[:, 0]) > 0.98


def test_run_page_has_the_numbers_of_run_json(
    pages: dict[str, str], run_content: dict[str, Any]
) -> None:
    text = text_of(pages["run"])
    for estimator in run_content["estimators"].values():
        held_out = estimator["held_out"]
        error, sd = (held_out[f"relative_error_percent{s}"] for s in ("", "_sd"))
        assert plus_minus(error, sd) in text
        assert number(estimator["mse"]) in text
        for value in held_out["relative_error_percent_by_joint"][:2]:
            assert number(value) in text
    assert f"with an error of {plus_minus(0.888, 0.0274)} % (CAD 31.2 %, OLS 0.876 %)" in text
    assert "0.1445 ± 0.0035" in text
    assert "−0.012 ± 0.044" in text
    assert "0.71 ± 0.12" in text
    assert "12" in text
    assert number(run_content["condition_number"]) in text
    assert "18 446 rows" in text


def test_friction_of_a_joint_that_slides_is_a_force_over_metres(run_report: RunReport) -> None:
    (friction,) = run_report.friction
    page = render(run_page(replace(run_report, friction=(replace(friction, joint=2),))))
    assert "friction [N]" in page
    assert "m/s, N" in text_of(page)
    assert "friction [N·m]" not in page


def test_run_page_says_what_is_wrong_with_least_squares(pages: dict[str, str]) -> None:
    assert (
        "Ordinary least squares gives an arm that cannot exist: its mass matrix is positive at"
        " 47.1 % of random postures, and fc1 came out negative."
    ) in text_of(pages["run"])


def test_an_impossible_model_is_not_called_good(run_report: RunReport) -> None:
    content = copy.deepcopy(dict(run_report.content))
    content["estimators"]["feasible"]["feasible"] = False
    verdict = run_page(replace(run_report, content=content)).verdict
    assert (verdict.status, verdict.word) == ("bad", "physically impossible")
    assert verdict.sentence.startswith("A model that no arm can have, which predicts")


@pytest.mark.parametrize(
    ("verdict", "status"), [("trustworthy", "good"), ("doubtful", "warning"), ("refused", "bad")]
)
def test_the_verdict_of_run_json_leads(verdict: str, status: str, run_report: RunReport) -> None:
    remarks = [{"code": "units", "joints": [1], "sentence": "Joint 1 seems to be in degrees."}]
    content = dict(run_report.content) | {"verdict": verdict, "remarks": remarks}
    shown = run_page(replace(run_report, content=content)).verdict
    assert shown.status == status
    assert shown.more[0] == "Joint 1 seems to be in degrees."


@pytest.mark.parametrize(
    ("code", "verdict", "first"),
    [
        ("units", "doubtful", ["ident", "run"]),
        ("large_error", "doubtful", ["ident", "gap"]),
        ("units", "refused", ["ident", "run"]),
        ("note", "trustworthy", ["ident", "validate"]),
    ],
)
def test_what_to_do_next_follows_the_verdict(
    code: str, verdict: str, first: list[str], run_report: RunReport
) -> None:
    advice = "" if verdict == "trustworthy" else "Mend it."
    remarks = [{"code": code, "joints": [], "sentence": "Something.", "advice": advice}]
    provenance = dict(run_report.content["provenance"])
    provenance["arm"] = {"name": "ur10", "described in": "ur10.urdf"}
    content = dict(run_report.content) | {"verdict": verdict, "remarks": remarks}
    content |= {"provenance": provenance}
    steps = run_page(replace(run_report, content=content)).steps
    assert list(steps[0].words[:2]) == first
    assert {"run", "gap"} >= {s.words[1] for s in steps if "--robot" in s.words} > set()
    assert verdict != "refused" or len(steps) == 1


def test_validate_page_has_the_numbers_of_validate_json(
    pages: dict[str, str], validate_content: dict[str, Any]
) -> None:
    text = text_of(pages["validate"])
    log = validate_content["logs"][0]
    error = plus_minus(log["relative_error_percent"], log["relative_error_percent_sd"])
    assert (
        "The model predicts the torque of a recording that it was not fitted on with an error of"
        f" {error} % on one.mcap."
    ) in text
    ordinary = percent(log["estimators"]["ols"]["relative_error_percent"])
    assert f"one.mcap {' '.join(ordinary.split())}." in text


def test_a_recording_of_the_fit_is_no_proof(validate_content: dict[str, Any], trace: Trace) -> None:
    content = validate_content | {"fitted_on": ["/data/one.mcap"]}
    verdict = validate_page(content, (trace,)).verdict
    assert verdict.status == "warning"
    assert verdict.more[0] == "The model was fitted on one.mcap: its error there says little."


def test_gap_page_has_the_numbers_of_gap_json(pages: dict[str, str]) -> None:
    text = text_of(pages["gap"])
    assert (
        "The model misses something that looks like friction of a motor that drives two"
        " joints at once at joints 1 (base) and 2 (lift), but these data cannot tell it from"
        " other effects."
    ) in text
    assert (
        "Adding it closes 94 % of the gap: on held-out data, the error falls from 3.21 % to 1.23 %."
    ) in text
    assert (
        "Evidence: it needed 0.21, and has 0.37 (log-likelihood gained per sample); its size is"
        " 12 standard deviations from zero; confirmed on 3"
        " of 3 parts of the recordings, each with the size that the others give it; none of 4"
        " effect-free simulations of this arm looks like it; the next best explanation, a base"
        " that is not level at joint 1 (base), has 0.12."
    ) in text
    assert (
        "Its coulomb 1 leans on a base that is not level at joint 1 (base): without that effect it"
        " would be 0.0520 N·m."
    ) in text
    assert "The torque constants are right." in text
    assert "extra friction at low speed (Stribeck effect) extra friction [N·m] 0.020 0.030" in text
    assert "Held still, so they show nothing: joint 3 (slide)." in text
    assert "turning round: with it [N·m]" in text
    assert "0.0412 ± 0.0031" in text
    assert "How it shows: depends on the speeds of both joints; it turns with the motor" in text
    assert (
        "To tell them apart, move both joints together, in all combinations of direction and of who"
        " is faster: ident design --for coupled_friction:1."
    ) in text
    assert "Not to be told by this motion: a base that is not level" in text
    assert "a.mcap 1 500 3 samples were left out" in text


def test_gap_page_shows_the_error_step_by_step(
    gap_report: GapReport, gap_content: dict[str, Any]
) -> None:
    added = [("rigid_body", []), ("coulomb", []), ("torque_offset", [2]), ("torque_delay", [1, 2])]
    steps = [
        {"added": name, "joints": joints, "relative_error_percent": 12.5 / (k + 1)}
        for k, (name, joints) in enumerate(added)
    ]
    page = render(gap_page(replace(gap_report, content=gap_content | {"steps": steps})))
    for label in ("rigid body", "+ Coulomb friction", "+ torque offset, joint 2"):
        assert label in page
    assert "+ torque delay, joints 1 and 2" in page
    assert "step by step" not in render(gap_page(gap_report))


@pytest.mark.parametrize(
    ("verdict", "sentence"),
    [
        ("no_gap", "The model explains these recordings down to their noise."),
        ("unknown", "The model misses something that no effect of the catalogue explains."),
        ("data_fault", "These recordings cannot be trusted, so no effect is named."),
    ],
)
def test_gap_without_a_named_effect(
    verdict: str, sentence: str, gap_report: GapReport, gap_content: dict[str, Any]
) -> None:
    content = gap_content | {"verdict": verdict, "effects": []}
    page = gap_page(replace(gap_report, content=content))
    assert page.verdict.sentence == sentence
    assert page.verdict.more == []


@pytest.mark.parametrize(
    ("left", "said"),
    [
        (1.2, "The model explains these recordings down to their noise."),
        (
            15.9,
            "Nothing in what the model leaves, 15.9 % of the torque, shows an effect of the"
            " catalogue; motion that repeats differs by only 1.00 %, so not all of it is noise.",
        ),
    ],
)
def test_what_is_left_far_above_the_noise_is_not_called_noise(
    left: float, said: str, gap_report: GapReport, gap_content: dict[str, Any]
) -> None:
    told = {k: {"relative_error_percent": v} for k, v in (("after", left), ("noise_floor", 1.0))}
    content = gap_content | {"verdict": "no_gap", "effects": []}
    content["held_out"] = content["held_out"] | told
    page = gap_page(replace(gap_report, content=content))
    assert " ".join(page.verdict.sentence.split()) == said


def test_what_is_there_and_not_sure_is_not_outside_the_catalogue(
    gap_report: GapReport, gap_content: dict[str, Any]
) -> None:
    unsure = {
        "name": "stribeck",
        "joints": [1],
        "in_model": False,
        "doubt": "its size is 1.1 standard deviations from zero, and 3 are asked for",
        "evidence": {"standard_deviations": 1.1},
    }
    content = gap_content | {"verdict": "unknown", "effects": [], "suspected": [unsure]}
    page = gap_page(replace(gap_report, content=content | {"unexplained": []}))
    assert page.verdict.sentence == (
        "The model misses something that these data are not enough to name."
    )


def test_terms_that_the_model_holds_are_told(
    gap_report: GapReport, gap_content: dict[str, Any]
) -> None:
    sizes = ((1, -0.3, 0.03), (2, 0.1, 0.09), (3, 0.2, None))
    terms = [
        {
            "name": "torque_offset",
            "joints": [joint],
            "parameters": {"offset": {"value": value, "sd": sd, "unit": "N m"}},
        }
        for joint, value, sd in sizes
    ]
    page = gap_page(replace(gap_report, content=gap_content | {"terms": terms}))
    (said,) = (m for m in page.verdict.more if "The model also holds" in m)
    assert "at joint 1 (base), as terms that `ident run` fits at all joints." in said
    text = text_of(render(page)).replace("\u202f", " ")
    assert f"{plus_minus(-0.3, 0.03)} N·m" in text
    assert "0.100 ± 0.090 N·m" in text


def test_without_an_effect_there_is_no_before_and_after(
    gap_report: GapReport, gap_content: dict[str, Any]
) -> None:
    content = gap_content | {"verdict": "no_gap", "effects": [], "where": []}
    page = gap_page(replace(gap_report, content=content, curves=()))
    assert page.sections[0].heading == "What could have been seen"
    text = text_of(render(page))
    assert not re.search(r"without it|with it|of the gap closed", text)
    named = [s.heading for s in gap_page(gap_report).sections]
    assert named.index("What is missing") < named.index("What could have been seen")


def test_any_missing_number_of_a_gap_is_a_dash(gap_report: GapReport) -> None:
    for path in numbers_in(gap_report.content):
        content = without(gap_report.content, path, None)
        text = text_of(render(gap_page(replace(gap_report, content=content))))
        assert re.findall(r"\b(?:nan|None|NaN|inf)\b", text) == [], path


def test_compared_runs_differ_where_they_do(run_content: dict[str, Any]) -> None:
    other = copy.deepcopy(run_content)
    other["base_parameters"][0]["feasible"] += 4.0 * math.hypot(0.0035, 0.0035)
    other["base_parameters"][1]["feasible"] += 2.0 * math.hypot(0.044, 0.044)
    page = compare_page(Comparison(("old", "new"), (run_content, other)))
    assert page.verdict.sentence == (
        "1 of 2 base parameters differ by more than 3 combined standard errors: L1yy + L2zz."
    )
    text = text_of(render(page))
    assert f"0.1437 ± {number(1.645 * 0.0035, 2)}" in text
    assert "ident gap /data/one.mcap --model old/model.yaml" in text
    worse = copy.deepcopy(run_content)
    worse["estimators"][worse["estimator"]]["held_out"]["relative_error_percent"] += 50.0
    page = compare_page(Comparison(("old", "new"), (run_content, worse)))
    assert page.verdict.status == "warning"
    assert "The held-out errors do: new predicts worse" in page.verdict.sentence
    same = compare_page(Comparison(("old", "new"), (run_content, run_content)))
    assert same.verdict.status == "good"


def test_many_effects_are_counted_first(gap_report: GapReport, gap_content: dict[str, Any]) -> None:
    kinds = (("coupled_friction", [1, 2]), ("coupled_friction", [2, 3]), ("torque_offset", [1]),
             ("joint_spring", [3]))  # fmt: skip
    effects = [gap_content["effects"][0] | {"name": n, "joints": j} for n, j in kinds]
    content = gap_content | {"verdict": "named", "effects": effects}
    verdict = gap_page(replace(gap_report, content=content)).verdict
    one = "friction of a motor that drives two joints at once at joint"
    first = f"The model misses 4 kinds of effects, {one}s 1 (base) and 2 (lift) first."
    assert verdict.sentence == first
    assert verdict.more[0].startswith(f"In full: {one}s 1 (base) and 2 (lift); {one}s 2")


def test_effects_of_one_kind_at_single_joints_are_told_once(
    gap_report: GapReport, gap_content: dict[str, Any]
) -> None:
    effects = [gap_content["effects"][0] | {"name": "torque_offset", "joints": [j]} for j in (3, 1)]
    content = gap_content | {"verdict": "named", "effects": effects}
    verdict = gap_page(replace(gap_report, content=content)).verdict
    assert verdict.sentence.count("constant extra torque") == 1
    assert "at joints 1 (base) and 3" in verdict.sentence
    twice = content | {"effects": [*effects, effects[0]]}
    verdict = gap_page(replace(gap_report, content=twice)).verdict
    assert "(3 of this kind)" in verdict.sentence


@pytest.mark.parametrize(
    ("closed", "begins"), [(0.87, "Most of"), (0.2, "Part of"), (None, "Part of")]
)
def test_an_unknown_gap_begins_with_what_it_looks_like(
    closed: float | None, begins: str, gap_report: GapReport, gap_content: dict[str, Any]
) -> None:
    held_out = gap_content["held_out"] | {"closed_fraction": closed}
    content = gap_content | {"verdict": "unknown", "held_out": held_out, "suspected": []}
    page = gap_page(replace(gap_report, content=content))
    assert page.verdict.sentence.startswith(f"{begins} what the model misses looks like ")
    assert page.verdict.sentence.endswith("; no effect of the catalogue explains the rest.")
    assert "from 3.21" in page.verdict.more[0]


@pytest.mark.parametrize(
    ("joint", "after", "begins"), [(2, 3.2, "Most of"), (3, 3.2, "Part of"), (3, 1.3, "Most of")]
)
def test_light_joints_are_not_most_of_a_gap_that_a_heavy_one_keeps(
    joint: int, after: float, begins: str, gap_report: GapReport, gap_content: dict[str, Any]
) -> None:
    error = gap_content["held_out"]["after"] | {"relative_error_percent": after}
    held_out = gap_content["held_out"] | {"closed_fraction": 0.9, "after": error}
    left = {"joint": joint, "depends_on": "its position", "share_of_residual": 0.9, "nearest": []}
    left |= {"unexplained": 0.9}
    content = gap_content | {"verdict": "unknown", "held_out": held_out, "unexplained": [left]}
    page = gap_page(replace(gap_report, content=content))
    assert page.verdict.sentence.startswith(f"{begins} what the model misses looks like ")


def test_design_page_says_how_near_the_limits_are(
    pages: dict[str, str], design_report: DesignReport
) -> None:
    text = text_of(pages["design"])
    assert "A motion that shows 57 base parameters with a condition number of 56.8." in text
    worst = max((float(used_share(q).max()), q.name) for q in design_report.per_joint())
    assert "It keeps every limit of the design." in text
    assert f"the {worst[1]} comes closest to its limit, with {number(worst[0])} % of" in text
    assert "No two bodies come closer than 0.100 m." in text


def test_design_page_names_the_limits_that_are_passed(design_report: DesignReport) -> None:
    *others, distance = design_report.quantities
    near = replace(distance, lower=np.array([0.15]))
    page = design_page(replace(design_report, quantities=[*others, near]))
    assert page.verdict.status == "bad"
    assert page.verdict.more[0] == "It passes limits of the design: distance."


def test_design_page_for_one_effect(design_report: DesignReport) -> None:
    shown = replace(
        design_report.trajectory, promise={"shows": "stribeck:4", "condition_number": None}
    )
    page = design_page(replace(design_report, trajectory=shown))
    assert page.verdict.sentence == "A motion that makes one effect visible: stribeck:4."
    assert [words for _, words in page.figures] == [
        "a period, 3 of which count",
        "harmonics of 0.314159\u202frad/s",
    ]


def test_names_are_escaped(pages: dict[str, str]) -> None:
    assert "bench &lt;arm&gt;: identified model" in pages["run"]
    assert "<arm>" not in pages["run"]


def numbers_in(content: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Places of all measured numbers; counts, links, and the swept thresholds stay."""
    kept = ("joint", "samples", "rows", "rank", "thresholds_rad_s", "velocity_threshold")
    if isinstance(content, dict):
        parts = [(k, v) for k, v in content.items() if k not in kept]
    elif isinstance(content, list):
        parts = list(enumerate(content))
    else:
        return [path] if isinstance(content, float) else []
    return [found for key, value in parts for found in numbers_in(value, (*path, key))]


def without(content: Any, path: tuple[Any, ...], value: float | None) -> Any:
    """The content with another number at a place."""
    changed = copy.deepcopy(content)
    place = changed
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    return changed


@pytest.mark.parametrize("missing", [None, math.nan])
def test_any_missing_number_is_a_dash(missing: float | None, run_report: RunReport) -> None:
    report = replace(run_report, traces=())
    for path in numbers_in(report.content):
        content = without(report.content, path, missing)
        text = text_of(render(run_page(replace(report, content=content))))
        assert re.findall(r"\b(?:nan|None|NaN|inf)\b", text) == [], path
        assert DASH in text


def test_a_page_is_the_same_each_time(run_report: RunReport) -> None:
    assert render(run_page(run_report)) == render(run_page(run_report))


def test_long_recordings_do_not_make_long_pages(run_report: RunReport, trace: Trace) -> None:
    long = Trace(
        trace.name,
        np.tile(trace.t, 50),
        *(np.tile(a, (50, 1)) for a in (trace.measured, trace.predicted, trace.counted)),
    )
    page = render(run_page(replace(run_report, traces=(long,) * 6)))
    assert len(page) < 1_500_000
    assert "2 more recordings are in the tables only." in page


def test_an_effect_of_a_light_joint_is_told_at_that_joint(gap_report, gap_content) -> None:
    held_out = {
        "before": {"relative_error_percent": 0.05088, "rms_by_joint": [0.3, 1.57e-4, None]},
        "after": {"relative_error_percent": 0.05087, "rms_by_joint": [0.3, 5.8e-6, None]},
        "noise_floor": {"relative_error_percent": 0.05, "rms_by_joint": [0.3, 5e-6, None]},
        "closed_fraction": 0.997,
    }
    content = gap_content | {"verdict": "named", "held_out": held_out}
    sentences = " ".join(verdict_sentences(replace(gap_report, content=content)))
    assert "from 0.000157\u202fN·m to 5.80·10⁻⁶\u202fN·m" in sentences
    assert gap_report.of([2]) in sentences
    assert "0.0509" not in sentences


def test_a_torque_that_comes_again_asks_for_what_the_arms_file_lacks(
    gap_report, gap_content
) -> None:
    left = {
        "joint": 2,
        "depends_on": "the angle of joint 2, periodically, about every 0.26 rad",
        "share_of_residual": 0.99,
        "unexplained": 0.3,
        "nearest": [],
    }
    ripple = catalogue()["torque_ripple"]
    entry = {"name": ripple.id, "joints": [], "lacks": ripple.asks_of_arm}

    def told(*unseen: dict[str, Any]) -> str:
        content = gap_content | {"unexplained": [left], "not_observable": list(unseen)}
        report = replace(gap_report, content=content)
        return " ".join(verdict_sentences(report)) + render(gap_page(report))

    assert ripple.asks_of_arm in told(entry)
    assert told(entry).count("Not looked for: torque ripple") == 3  # summary, page, its table
    assert "Not looked for" not in told()


def test_what_is_left_of_a_closed_gap_is_told_by_its_share_of_it(gap_report, gap_content) -> None:
    left = {
        "joint": 2,
        "depends_on": "the speed of joint 2",
        "share_of_residual": 0.54,
        "nearest": [
            {"name": "stribeck", "joints": [2], "evidence": 0.1, "share_of_residual": 0.18}
        ],
    }

    def told(share: float) -> str:
        content = gap_content | {"unexplained": [left | {"unexplained": share}]}
        return " ".join(verdict_sentences(replace(gap_report, content=content)))

    assert "depends on the speed of joint 2: less than 2\u202f% of the gap that was there." in told(
        0.001
    )
    assert "The catalogue explains" not in told(0.001)
    more = "depends on the speed of joint 2. The catalogue explains at most 18\u202f% of it"
    assert more in told(0.3)
    assert gap_report.of([2]) in told(0.3)


def test_effects_of_one_kind_are_told_once(gap_report, gap_content) -> None:
    (first, *_) = gap_content["effects"]
    ripples = [first | {"name": "torque_ripple", "joints": [2]} for _ in range(3)]
    pushes = [first | {"name": "contact", "joints": joints} for joints in ([1, 2], [1])]
    content = gap_content | {"verdict": "named", "effects": [*ripples, *pushes]}
    sentence = verdict_sentences(replace(gap_report, content=content))[0]
    assert sentence.count(catalogue()["torque_ripple"].title) == 1
    assert "(3 of this kind)" in sentence
    assert sentence.count("(2 of this kind)") == 1


@pytest.mark.parametrize(
    ("after", "sentence", "whole"),
    [
        (
            [1.47, 2.0],
            "Adding it does not lower the error on held-out data (5.00 % before, 5.00 %",
            5.0,
        ),
        ([0.54, 1.99], "the error of joint 1 falls from 1.47 N·m to 0.540 N·m.", 5.0),
        ([0.54, 2.4], "to 0.540 N·m, and that of joint 2 rises from 2.00 N·m to 2.40 N·m.", 5.0),
        ([0.54, 2.0], "that of the whole arm rises from 5.00 % to 6.20 %.", 6.2),
    ],
)
def test_joints_at_which_an_effect_does_nothing_or_harm(
    after: list[float], sentence: str, whole: float
) -> None:
    sides = ([5.0, [1.47, 2.0]], [whole, after])
    held_out: dict[str, Any] = {
        name: {"relative_error_percent": percent, "rms_by_joint": rms}
        for name, (percent, rms) in zip(("before", "after"), sides, strict=True)
    }
    said = closed_text(held_out | {"closed_fraction": 0.0}, lambda joints: f"joint {joints[0]}")
    assert sentence in said.replace("\u202f", " ")


def test_of_few_joints_gap_nothing_may_be_closed_where_the_error_falls() -> None:
    """It said "closes 0 % of the gap: the error falls from 2.68 % to 1.20 %"."""
    sides = {
        name: {"relative_error_percent": error, "rms_by_joint": [rms, 1.0]}
        for name, error, rms in (("before", 2.68, 2.0), ("after", 1.20, 0.5))
    }

    def said(closed: float, others: float) -> str:
        more = {k: {"relative_error_percent": others} for k in ("before", "after")}
        held_out = sides | {"closed_fraction": closed, "other_recordings": more}
        return closed_text(held_out, lambda joints: f"joint {joints[0]}").replace("\u202f", " ")

    assert said(0.0, 3.0).startswith(
        "Adding it lowers the error on held-out data from 2.68 % to 1.20 %, but closes 0 % of the"
        " gap at the joints that keep structure. On each recording, predicted by fits to"
    )
    assert said(0.8, 3.0).startswith("Adding it closes 80 % of the gap: on held-out data, the")
    assert "not explained at all" in said(0.8, 4e15)
    assert "e+15" not in said(0.8, 4e15)
