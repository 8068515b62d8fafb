"""Pages: whole, self-contained, readable aloud, and true to the result files."""

import copy
import math
import re
from dataclasses import replace
from itertools import pairwise
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from ident.report.design_page import DesignReport, design_page, used_share
from ident.report.gap_page import GapReport, gap_page, verdict_sentences
from ident.report.page import render
from ident.report.run_page import RunReport, run_page
from ident.report.traces import Trace
from ident.report.validate_page import ValidationReport, validate_page
from ident.report.words import DASH, number, percent, plus_minus

VOID = ("meta",)


@pytest.fixture(scope="session")
def pages(
    run_report: RunReport,
    validate_content: dict[str, Any],
    trace: Trace,
    gap_report: GapReport,
    design_report: DesignReport,
) -> dict[str, str]:
    return {
        "run": render(run_page(run_report)),
        "validate": render(validate_page(ValidationReport(validate_content, (trace,)))),
        "gap": render(gap_page(gap_report)),
        "design": render(design_page(design_report)),
    }


@pytest.fixture(params=["run", "validate", "gap", "design"])
def html(request: pytest.FixtureRequest, pages: dict[str, str]) -> str:
    return pages[request.param]


def tree(html: str) -> ElementTree.Element:
    """The page as XML, which it is but for the doctype and the elements that never close."""
    body = re.sub(r"<!doctype html>", "", html)
    for tag in VOID:
        body = re.sub(rf"<({tag}\b[^>]*)>", r"<\1/>", body)
    return ElementTree.fromstring(body)


def text_of(html: str) -> str:
    return " ".join(re.sub(r"<style>.*?</style>|<[^>]+>", " ", html, flags=re.DOTALL).split())


def local(element: ElementTree.Element) -> str:
    return element.tag.rpartition("}")[2]


def drawings(html: str) -> list[ElementTree.Element]:
    return [e for e in tree(html).iter() if local(e) == "svg" and e.get("role") == "img"]


def test_every_element_is_closed_and_every_id_is_there_once(html: str) -> None:
    ids = [e.get("id") for e in tree(html).iter() if e.get("id")]
    assert len(ids) == len(set(ids))


def test_nothing_is_fetched(html: str) -> None:
    assert re.findall(r"""(?:src|href)=["'](?!#)|url\(|@import|<script|<link""", html) == []
    assert set(re.findall(r"https?://[^\"']*", html)) == {"http://www.w3.org/2000/svg"}


def test_headings_follow_each_other_and_the_contents_lead_to_them(html: str) -> None:
    page = tree(html)
    levels = [int(local(e)[1]) for e in page.iter() if re.fullmatch(r"h\d", local(e))]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(b - a <= 1 for a, b in pairwise(levels))
    ids = {e.get("id") for e in page.iter()}
    links = [e.get("href", "") for e in page.iter() if local(e) == "a"]
    assert links
    assert all(link.removeprefix("#") in ids for link in links)


def test_every_figure_has_a_title_a_description_and_units(html: str) -> None:
    found = drawings(html)
    assert found
    for svg in found:
        words = {local(e): e for e in svg if local(e) in ("title", "desc")}
        names = svg.get("aria-labelledby", "").split()
        assert [words["title"].get("id"), words["desc"].get("id")] == names
        assert words["title"].text
        assert words["desc"].text
        labels = [e.text or "" for e in svg.iter() if local(e) == "text"]
        assert any(re.search(r"\[[^\]]+\]$", label) for label in labels)


def test_every_gallery_has_a_caption_and_every_table_heads(html: str) -> None:
    page = tree(html)
    for figure in (e for e in page.iter() if local(e) == "figure"):
        assert any(local(e) == "figcaption" and e.text for e in figure)
    for table in (e for e in page.iter() if local(e) == "table"):
        assert table.find("caption") is not None
        heads = [e for e in table.iter() if local(e) == "th"]
        assert {e.get("scope") for e in heads} == {"col", "row"}
        assert all(e.text for e in heads)
        columns = len(table.findall("./thead/tr/th"))
        assert all(len(row) == columns for row in table.findall("./tbody/tr"))


def test_nothing_lies_outside_a_figure(html: str) -> None:
    for svg in drawings(html):
        _, _, width, height = map(float, svg.get("viewBox", "").split())
        for path in (e.get("d", "") for e in svg.iter() if local(e) == "path"):
            points = re.findall(r"[ML]([-\d.]+) ([-\d.]+)", path)
            assert all(0 <= float(x) <= width and 0 <= float(y) <= height for x, y in points)
        for word in (e for e in svg.iter() if local(e) == "text"):
            assert 0 <= float(word.get("x", "")) <= width
            assert 0 <= float(word.get("y", "")) <= height


def test_joints_that_were_held_have_no_torque_figure(pages: dict[str, str]) -> None:
    titles = [svg[0].text for svg in drawings(pages["run"])]
    assert [t for t in titles if t and t.startswith("Torque of joint")] == [
        "Torque of joint 1 base over time",
        "Torque of joint 2 lift over time",
    ]


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


def test_run_page_says_what_is_wrong_with_least_squares(pages: dict[str, str]) -> None:
    assert (
        "Ordinary least squares gives an arm that cannot exist: its mass matrix is positive at"
        " 47.1 % of random postures, and fc1 came out negative."
    ) in text_of(pages["run"])


def test_an_impossible_model_is_not_called_good(run_report: RunReport) -> None:
    content = copy.deepcopy(dict(run_report.content))
    content["estimators"]["feasible"]["feasible"] = False
    verdict = run_page(replace(run_report, content=content)).verdict
    assert (verdict.status, verdict.word) == ("bad", "not feasible")
    assert verdict.sentence.startswith("No physically possible model that predicts")


def test_validate_page_has_the_numbers_of_validate_json(
    pages: dict[str, str], validate_content: dict[str, Any]
) -> None:
    text = text_of(pages["validate"])
    log = validate_content["logs"][0]
    error = plus_minus(log["relative_error_percent"], log["relative_error_percent_sd"])
    assert (
        "The model predicts the torque of a recording that it was not fitted on with errors of"
        f" one.mcap {error} %."
    ) in text
    ordinary = percent(log["estimators"]["ols"]["relative_error_percent"])
    assert f"one.mcap {' '.join(ordinary.split())}." in text


def test_a_recording_of_the_fit_is_no_proof(validate_content: dict[str, Any], trace: Trace) -> None:
    content = validate_content | {"fitted_on": ["/data/one.mcap"]}
    verdict = validate_page(ValidationReport(content, (trace,))).verdict
    assert verdict.status == "warning"
    assert verdict.more[0] == "The model was fitted on one.mcap: its error there says little."


def test_gap_page_has_the_numbers_of_gap_json(pages: dict[str, str]) -> None:
    text = text_of(pages["gap"])
    assert (
        "The model misses something that looks like friction on the motors of a shared drive at"
        " joints 1 base and 2 lift, but these data cannot tell it from other effects."
    ) in text
    assert "falls from 3.21 % to 1.23 %: 94 % of what could be closed." in text
    assert "0.0412 ± 0.0031" in text
    assert "How it shows: turns with the motor." in text
    assert (
        "To tell them apart, move joints 1 and 2 together: ident design --for coupled_friction:1."
    ) in text
    assert "gravity tilt at the whole arm" in text


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
        ("data_fault", "These recordings cannot be trusted, so that no effect is named."),
    ],
)
def test_gap_without_a_named_effect(
    verdict: str, sentence: str, gap_report: GapReport, gap_content: dict[str, Any]
) -> None:
    content = gap_content | {"verdict": verdict, "effects": []}
    page = gap_page(replace(gap_report, content=content))
    assert page.verdict.sentence == sentence
    assert page.verdict.more == []


def test_many_effects_are_counted_first(gap_report: GapReport, gap_content: dict[str, Any]) -> None:
    places = ([1, 2], [1], [2], [3])
    effects = [gap_content["effects"][0] | {"joints": joints} for joints in places]
    content = gap_content | {"verdict": "named", "effects": effects}
    verdict = gap_page(replace(gap_report, content=content)).verdict
    one = "friction on the motors of a shared drive at joint"
    assert verdict.sentence == f"The model misses 4 effects, {one}s 1 base and 2 lift first."
    assert verdict.more[0].startswith(f"In full: {one}s 1 base and 2 lift; {one} 1 base; {one} 2")


def test_an_unknown_gap_says_what_part_of_it_looks_like(
    gap_report: GapReport, gap_content: dict[str, Any]
) -> None:
    page = gap_page(replace(gap_report, content=gap_content | {"verdict": "unknown"}))
    assert page.verdict.sentence.endswith("that no effect of the catalogue explains.")
    assert page.verdict.more[0].startswith("Part of it looks like ")
    assert "falls from 3.21" in page.verdict.more[1]


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
    assert gap_report.labels[1] in sentences
    assert "0.0509" not in sentences


def test_effects_of_one_kind_are_told_once(gap_report, gap_content) -> None:
    (first, *_) = gap_content["effects"]
    ripples = [first | {"name": "torque_ripple", "joints": [2]} for _ in range(3)]
    pushes = [first | {"name": "contact", "joints": joints} for joints in ([1, 2], [1])]
    content = gap_content | {"verdict": "named", "effects": [*ripples, *pushes]}
    sentence = verdict_sentences(replace(gap_report, content=content))[0]
    assert sentence.count("torque_ripple") + sentence.count("torque ripple") == 1
    assert "(3 of this kind)" in sentence
    assert sentence.count("(2 of this kind)") == 1
