"""The rounds of an investigation, with programs that write down results at once."""

import json
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import yaml

from wamctl.arm.configuration.known_change import KnownChangeError, known_change
from wamctl.errors import UsageError
from wamctl.investigation import rounds as rounds_module
from wamctl.investigation.budget import Budget, Cost, duration_s, limited
from wamctl.investigation.decision import borne_out, ended, suspect_that_leads
from wamctl.investigation.investigate import investigate
from wamctl.investigation.programs import ProgramError, call
from wamctl.investigation.rounds import Site
from wamctl.investigation.state import Request, Round

ERRORS = {"relative_error_percent": 1.0, "rms_by_joint": [0.1]}
STRIBECK = {
    "name": "stribeck",
    "joints": [1],
    "parameters": {"extra_friction": {"value": 0.9, "sd": 0.01, "unit": "N m"}},
    "equation": "tau_j += dF exp(-(|qd_j|/vs)^d) sgn(qd_j)",
    "evidence": {},
    "rivals": [],
    "separating_experiment": None,
}


CURVE = {
    "name": "measured_effect",
    "depends_on": "position",
    "words": "the position of joint 3",
    "between": [-1.0, 1.0],
    "corners": 3,
    "parameters": {f"at_{k}": {"value": 0.1 * k, "sd": 0.01, "unit": "N m"} for k in (1, 2)},
    "resembles": ["joint_spring"],
}


class Programs:
    """Writes what each command would; `ends` says at which call it fails or is killed."""

    better_once_changed = 1.0

    def __init__(self, verdicts: list[str], better: float, ends: dict[int, BaseException]) -> None:
        self.verdicts, self.better, self.ends = verdicts, better, dict(ends)
        self.calls: list[str] = []
        self.changed: list[str] = []
        self.hidden: list[str] = []

    def __call__(self, module: str, arguments: list[str], lock: int | None = None) -> None:
        command = arguments[0]
        self.calls.append(command)
        out = Path(arguments[arguments.index("--out") + 1])
        end = self.ends.pop(len(self.calls), None)
        if end is not None:
            if command == "excite":
                out.write_text("part of a log")
            raise end
        getattr(self, f"_{command}")(out, arguments)

    def _excite(self, out: Path, arguments: list[str]) -> None:
        self.hidden.append(arguments[arguments.index("--hidden") + 1])
        out.write_text("log")

    def _gap(self, out: Path, arguments: list[str]) -> None:
        verdict = self.verdicts[sum(a.endswith(".mcap") for a in arguments) - 1]
        effects = [STRIBECK] if verdict == "named" else []
        held = {"before": ERRORS, "after": ERRORS, "noise_floor": ERRORS, "closed_fraction": 1.0}
        content = {"verdict": verdict, "effects": effects, "held_out": held, "arm": "wam7"}
        content["minimum_detectable"] = {"stribeck": {"1": 0.03, "3": 0.02}}
        content["detectable_units"] = {"stribeck": "N m"}
        out.mkdir()
        (out / "gap.json").write_text(json.dumps(content))
        (out / "model.yaml").write_text("model")
        (out / "report.html").write_text("page")

    def _plan(self, out: Path, arguments: list[str]) -> None:
        gap = json.loads(Path(arguments[arguments.index("--gap") + 1], "gap.json").read_text())
        leader = {"named": "stribeck:1", "unknown": "unknown"}.get(gap["verdict"], "none")
        if "--lead" in arguments:
            leader = arguments[arguments.index("--lead") + 1]
        rival = "none" if leader != "none" else "stribeck:1"
        if "--changed" in arguments:
            self.changed.append(arguments[arguments.index("--changed") + 1])
            self.better = self.better_once_changed
        motion = {
            "name": f"slow:{arguments.count('--ran') + 1}",
            "words": "It moves.",
            "seconds": 60.0,
        }
        (out / "models").mkdir(parents=True)
        (out / "trajectory.yaml").write_text("motion")
        (out / "models" / "0.yaml").write_text("curve")
        (out / "plan.json").write_text(
            json.dumps(
                {
                    "leader": leader,
                    "models": {n: MODEL | {"effects": [STRIBECK]} for n in (leader, rival)},
                    "measured": [STRIBECK | CURVE] if leader == "unknown" else [],
                    "intervention": "hang a mass",
                    "motion": motion | {"expected_nats": {rival: 5.0}},
                }
            )
        )

    def _weigh(self, out: Path, arguments: list[str]) -> None:
        plan = Path(arguments[arguments.index("--plan") + 1]) / "plan.json"
        content = json.loads(plan.read_text())
        nats = {name: np.full((20, 1), -10.0 * self.better).tolist() for name in content["models"]}
        nats[content["leader"]] = np.full((20, 1), -10.0).tolist()
        points = {"predicted_nm": [-0.02, 0.02], "measured_nm": [-0.03, 0.01], "sd_nm": [0.005] * 2}
        seen = {n: {"joint": 3} | points for n in content["models"] if n != content["leader"]}
        out.write_text(json.dumps({"logs": [weighed_log(nats)], "predicted": seen}))


MODEL = {"file": "models/0.yaml", "sha256": ""}


def weighed_log(nats: dict[str, Any]) -> dict[str, Any]:
    """What `ident weigh` says of a log, where each block counts as its squares do."""
    squares = {name: (-2.0 * np.sum(values, axis=0)).tolist() for name, values in nats.items()}
    return {"log": "log.mcap", "log_likelihood": nats, "squares": squares}


@pytest.fixture
def outcome(tmp_path, monkeypatch):
    """Runs an investigation in a folder with some programs."""
    monkeypatch.setattr(rounds_module, "cost_of", lambda *_: Cost(50.0, 20.0, 0.2))
    limits = SimpleNamespace(motor_torque_nm=(1.0,))
    arm: Any = SimpleNamespace(transmission=None, file=SimpleNamespace(drives=None, limits=limits))
    first = tmp_path / "first.yaml"
    first.write_text("first motion")

    def run(
        programs: Programs,
        folder: str = "out",
        resume: bool = False,
        ask: Any = lambda _: "",
        answer: str = "",
        **budget: Any,
    ):
        monkeypatch.setattr(rounds_module, "call", programs)
        site = Site(tmp_path / folder, arm, (), lambda _: None, ask)
        request = Request("wam7.yaml", "sim", True, "stribeck", 0, str(first))
        return investigate(site, request, Budget(**budget), resume, answer).content

    return run


def test_a_name_is_confirmed_by_a_motion_that_it_predicted(outcome, tmp_path):
    found = outcome(Programs(["named", "named"], 5.0, {}))
    assert found["verdict"] == "named"
    assert found["confirmed"]
    assert [e["name"] for e in found["effects"]] == ["stribeck"]
    assert found["predicted_before_run"]["evidence_nats"]["none"] > 5.3
    odds = found["rounds"][1]["odds"]
    assert (odds["stribeck:1"] > 0.95, odds["none"] < 0.001) == (True, True)
    assert found["rounds"][1]["gap"] == "rounds/02/gap.json"
    written = json.loads((tmp_path / "out" / "investigation.json").read_text())
    assert written == found
    assert "stribeck" in (tmp_path / "out" / "report.html").read_text()


def test_a_name_that_predicts_no_better_is_never_confirmed(outcome):
    found = outcome(Programs(["named"] * 4, 1.0, {}))
    assert (found["verdict"], found["confirmed"]) == ("ambiguous", False)
    assert found["intervention"] == "hang a mass"
    assert len(found["rounds"]) == 4


class Doubting(Programs):
    """What `ident gap` leads with is `ambiguous` in every search."""

    def _gap(self, out: Path, arguments: list[str]) -> None:
        super()._gap(out, arguments)
        path = out / "gap.json"
        path.write_text(json.dumps(json.loads(path.read_text()) | {"verdict": "ambiguous"}))

    def _plan(self, out: Path, arguments: list[str]) -> None:
        super()._plan(out, [*arguments, "--lead", "stribeck:1"])


def test_what_the_search_calls_ambiguous_is_named_by_no_prediction_that_it_has_seen(outcome):
    found = outcome(Doubting(["named"] * 4, 5.0, {}))
    assert found["rounds"][-1]["evidence_nats"]["none"] > 5.3
    assert (found["verdict"], found["confirmed"], len(found["rounds"])) == ("ambiguous", False, 4)


def test_the_odds_of_an_ambiguous_end_are_those_of_the_search(outcome, monkeypatch):
    rival = {"name": "joint_spring", "joints": [1]}
    monkeypatch.setitem(STRIBECK, "rivals", [rival])
    odds = outcome(Doubting(["named"] * 4, 5.0, {}))["rounds"][-1]["odds"]
    assert odds["stribeck:1"] == pytest.approx(odds["joint_spring:1"])
    assert odds["stribeck:1"] > 0.4


def test_what_the_search_calls_ambiguous_is_named_by_a_prediction_of_the_changed_arm(outcome):
    programs = Doubting(["named"] * 9, 5.0, {})
    programs.better_once_changed = 5.0
    found = outcome(programs, ask=lambda _: "load=1.5,0,0,0.05")
    assert (found["verdict"], found["confirmed"], len(found["rounds"])) == ("named", True, 5)


def undecided(once_changed: float) -> Programs:
    programs = Programs(["named"] * 9, 1.0, {})
    programs.better_once_changed = once_changed
    return programs


def test_the_operators_answer_settles_what_no_motion_did(outcome, tmp_path):
    programs, asked = undecided(5.0), []

    def ask(question: str) -> str:
        asked.append(question)
        return "load=1.5,0,0,0.05"

    found = outcome(programs, ask=ask)
    assert (found["verdict"], found["confirmed"]) == ("named", True)
    assert len(asked) == 1
    assert "hang a mass" in asked[0]
    assert [r["changed"] for r in found["rounds"]] == ["", "", "", "", "load=1.5,0,0,0.05"]
    assert programs.changed == ["load=1.5,0,0,0.05"]
    # the log of the loaded arm is weighed, and never fitted
    assert programs.calls.count("gap") == 4
    assert programs.calls.count("weigh") == 4
    # the simulated arm has it as well, beside what it hides
    hidden = yaml.safe_load(Path(programs.hidden[-1]).read_text())["effects"]
    assert [e["effect"] for e in hidden] == ["stribeck", "payload"]
    assert hidden[1]["kg"] == 1.5
    assert programs.hidden[0] == "stribeck"
    assert "load=1.5" in (tmp_path / "out" / "report.html").read_text()


def test_without_a_terminal_it_ends_with_the_question_and_goes_on_with_an_answer(outcome):
    programs = undecided(5.0)
    found = outcome(programs)
    assert found["intervention"] == "hang a mass"
    assert len(found["rounds"]) == 4
    resumed = outcome(programs, resume=True, answer="load=1.5,0,0,0.05")
    assert (resumed["verdict"], resumed["confirmed"]) == ("named", True)


def test_it_asks_no_more_often_than_was_declared(outcome):
    asked = []

    def ask(question: str) -> str:
        asked.append(question)
        return "again"

    found = outcome(undecided(1.0), ask=ask, answers=2)
    assert (found["verdict"], len(asked), len(found["rounds"])) == ("ambiguous", 2, 6)


@pytest.mark.parametrize("call", range(16, 21))
def test_killed_after_an_answer_it_goes_on_to_the_same_result(outcome, call):
    whole = outcome(undecided(5.0), "whole", ask=lambda _: "load=1.5,0,0,0.05")
    programs = undecided(5.0)
    programs.ends[call] = KeyboardInterrupt()
    with pytest.raises(KeyboardInterrupt):
        outcome(programs, "killed", ask=lambda _: "load=1.5,0,0,0.05")
    resumed = outcome(programs, "killed", resume=True, ask=lambda _: "load=1.5,0,0,0.05")
    assert resumed | {"wall_s": 0.0} == whole | {"wall_s": 0.0}


def test_a_stop_in_the_first_motion_can_be_resumed(outcome):
    stop = ProgramError("wamctl excite", 5, "this computer held the loop up")
    programs = Programs(["named", "named"], 5.0, {1: stop})
    with pytest.raises(ProgramError, match="held the loop up") as raised:
        outcome(programs)
    assert raised.value.exit_code == 5
    assert outcome(programs, resume=True)["verdict"] == "named"


@pytest.mark.parametrize(
    "text", ["heavier", "load=1", "load=-1,0,0,0", "tilt=90,0", "load=a,b,c,d"]
)
def test_answers_that_tell_nothing_are_refused_in_a_sentence(text):
    with pytest.raises(KnownChangeError, match="tells no change of the arm"):
        known_change(text)


@pytest.mark.parametrize("verdict", ["no_gap", "unknown"])
def test_two_motions_are_asked_for_no_gap_and_for_a_gap_without_a_name(outcome, verdict):
    found = outcome(Programs([verdict] * 2, 1.0, {}))
    assert (found["verdict"], found["confirmed"], len(found["rounds"])) == (verdict, True, 2)
    assert [e["name"] for e in found["effects"]] == (
        ["measured_effect"] if verdict == "unknown" else []
    )


def test_a_measured_curve_comes_with_what_it_closes_on_the_motion_that_it_predicted(
    outcome, tmp_path
):
    (curve,) = outcome(Programs(["unknown"] * 2, 4.0, {}))["effects"]
    assert curve["evidence"]["closed_on_new_motion"] == pytest.approx(0.75)
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert ", over the position of joint 3.</h1>" in page
    first, middle, last = re.findall(r'polyline points="([^"]*)"', page)[0].split()
    assert first.split(",")[1] == last.split(",")[1] != middle.split(",")[1]


def test_a_rival_that_predicts_better_keeps_no_gap_from_being_final(outcome, tmp_path):
    found = outcome(Programs(["no_gap"] * 2, 0.05, {}), motions=1)
    assert found["confirmed"] is False
    page = (tmp_path / "out" / "report.html").read_text()
    assert "where they differ most, is 1.9e+03 % larger" in page
    suspecting = Suspecting(["no_gap"] * 2, 1.0, {})
    suspecting.left = 0.95  # by less than is asked, but ident gap suspects it
    found = outcome(suspecting, "suspecting", motions=1)
    assert found["rounds"][-1]["evidence_nats"]["stribeck:1"] > -found["rounds"][-1]["asked_nats"]
    assert (found["verdict"], found["confirmed"]) == ("no_gap", False)


def test_the_page_sets_predictions_against_what_was_measured_and_tells_units(outcome, tmp_path):
    outcome(Programs(["named", "named"], 5.0, {}))
    page = (tmp_path / "out" / "report.html").read_text()
    assert "measured, ± 40 mN\u202fm" in page
    assert "predicted, ± 20 mN\u202fm" in page
    assert page.count("<circle") == 2
    assert "[mN\u202fm]</span></td><td>30</td><td>20</td>" in page
    assert "0.900 ± 0.010 N\u202fm" in page


def test_a_curve_that_predicts_worse_than_no_effect_is_not_kept(outcome, tmp_path):
    found = outcome(Programs(["unknown"] * 3, 0.6, {}), motions=2)
    assert len(found["rounds"]) == 3, "another motion may find another curve"
    assert (found["verdict"], found["confirmed"], found["effects"]) == ("unknown", True, [])
    assert found["rounds"][-1]["odds"]["unknown"] > 0.95
    assert (tmp_path / "out" / "model.yaml").read_text() == "model"


def test_a_rival_that_refutes_no_effect_in_the_last_motion_makes_it_ambiguous(outcome):
    found = outcome(unseen(0.05), motions=1)
    assert (found["verdict"], found["confirmed"], len(found["rounds"])) == ("ambiguous", False, 2)
    assert "stribeck at joint 1 predicted the motions better than no effect" in found["why"]


@pytest.mark.parametrize(("left", "rounds"), [(0.95, 4), (0.98, 2), (1.02, 2)])
def test_no_gap_is_final_once_the_motions_left_could_not_bear_a_rival_out(outcome, left, rounds):
    found = outcome(unseen(left))
    verdict = "named" if rounds == 4 else "no_gap"
    assert (found["verdict"], len(found["rounds"])) == (verdict, rounds)


def test_the_effect_that_is_furthest_ahead_of_no_effect_leads():
    bets = {"none": [2.0] * 20, "torque_delay:1": [-1.0] * 20, "rotor_inertia:1": [0.5] * 20}
    common = ("slow", "why", "rounds/02", Cost(), "torque_delay:2", 6.0, {}, bets, {})
    assert suspect_that_leads([Round(*common, "no_gap")]) == "torque_delay:1"
    assert suspect_that_leads([Round(*common, "named", "stribeck:1")]) == ""


def test_an_effect_that_no_search_sees_is_not_told_from_a_lookalike_by_predictions():
    bets = {"none": [2.0] * 20, "rotor_inertia:1": [2.0] * 20}
    common = ("slow", "why", "rounds/02", Cost(), "torque_delay:1", 6.0, {}, bets, {})
    alone = Round(*common, "no_gap")
    assert borne_out([alone]) == "torque_delay:1"
    assert borne_out([replace(alone, lookalikes=("rotor_inertia:1",))]) == ""


def test_an_effect_that_no_search_sees_is_named_once_it_has_led_and_is_borne_out(outcome):
    found = outcome(unseen(0.05))
    assert (found["verdict"], found["confirmed"], len(found["rounds"])) == ("named", True, 3)
    assert [r["leader"] for r in found["rounds"]] == ["", "none", "stribeck:1"]
    (effect,) = found["effects"]
    assert effect == STRIBECK, "as the plan wrote it down"


def test_no_gap_is_final_where_there_is_no_room_for_the_motion_that_might_refute_it(outcome):
    found = outcome(Programs(["no_gap"] * 4, 0.95, {}), motion_s=140.0)  # 50 s a round
    assert (found["verdict"], found["confirmed"], len(found["rounds"])) == ("no_gap", True, 2)


class Suspecting(Programs):
    """Never named, only suspected; whatever leads, the suspect leaves so much of the squares."""

    left = 0.3
    suspected: tuple[dict[str, Any], ...] = (STRIBECK,)

    def _gap(self, out: Path, arguments: list[str]) -> None:
        super()._gap(out, arguments)
        path = out / "gap.json"
        more = {"suspected": list(self.suspected)}
        path.write_text(json.dumps(json.loads(path.read_text()) | more))

    def _weigh(self, out: Path, arguments: list[str]) -> None:
        nats = {"none": np.full((20, 1), -10.0).tolist()}
        nats["stribeck:1"] = np.full((20, 1), -10.0 * self.left).tolist()
        out.write_text(json.dumps({"logs": [weighed_log(nats)]}))


def unseen(left: float) -> Programs:
    """A rival that no search sees leaves so much of the squares, whatever leads."""
    programs = Suspecting(["no_gap"] * 9, 1.0, {})
    programs.left, programs.suspected = left, ()
    return programs


def test_a_suspect_that_predicts_better_leads_and_is_named_once_a_motion_bears_it_out(outcome):
    programs = Suspecting(["no_gap"] * 9, 1.0, {})
    programs.left = 0.92
    found = outcome(programs)
    assert (found["verdict"], found["confirmed"], len(found["rounds"])) == ("named", True, 3)
    assert [r["leader"] for r in found["rounds"]] == ["", "none", "stribeck:1"]
    assert found["rounds"][2]["asked_nats"] == pytest.approx(np.log(800.0))
    assert [e["name"] for e in found["effects"]] == ["stribeck"]


class AllSuspected(Suspecting):
    """A gap without a name, of which what is suspected may be all."""

    unexplained: tuple[dict[str, int], ...] = ()

    def _gap(self, out: Path, arguments: list[str]) -> None:
        super()._gap(out, arguments)
        path = out / "gap.json"
        more = {"unexplained": list(self.unexplained)}
        path.write_text(json.dumps(json.loads(path.read_text()) | more))

    def _plan(self, out: Path, arguments: list[str]) -> None:
        super()._plan(out, arguments if "--lead" in arguments else [*arguments, "--lead", "none"])


def test_a_suspect_that_may_be_the_whole_gap_is_named_once_a_motion_bears_it_out(outcome):
    found = outcome(AllSuspected(["unknown"] * 9, 1.0, {}))
    assert (found["verdict"], found["confirmed"], len(found["rounds"])) == ("named", True, 2)
    assert [e["name"] for e in found["effects"]] == ["stribeck"]


class WithCurve(AllSuspected):
    """A measured curve stands beside the suspect, and leaves so much of the squares."""

    curve = 0.1
    unsettled: tuple[str, ...] = ()

    def _plan(self, out: Path, arguments: list[str]) -> None:
        super()._plan(out, arguments)
        path = out / "plan.json"
        plan = json.loads(path.read_text())
        names = ("none", "stribeck:1", "unknown")
        plan["models"] = {n: MODEL | {"effects": [STRIBECK]} for n in names}
        more = {"measured": [STRIBECK | CURVE], "unsettled": list(self.unsettled)}
        path.write_text(json.dumps(plan | more))

    def _weigh(self, out: Path, arguments: list[str]) -> None:
        left = {"none": 1.0, "stribeck:1": self.left, "unknown": self.curve}
        nats = {n: np.full((20, 1), -10.0 * share).tolist() for n, share in left.items()}
        out.write_text(json.dumps({"logs": [weighed_log(nats)]}))


def test_a_suspect_whose_form_a_curve_refutes_is_no_name_but_that_curve(outcome, tmp_path):
    found = outcome(WithCurve(["unknown"] * 9, 1.0, {}))
    assert (found["verdict"], found["confirmed"], len(found["rounds"])) == ("unknown", True, 2)
    (curve,) = found["effects"]
    assert curve["name"] == "measured_effect"
    assert curve["evidence"]["closed_on_new_motion"] == pytest.approx(0.9)
    assert (tmp_path / "out" / "model.yaml").read_text() == "curve"
    assert found["rounds"][-1]["odds"]["unknown"] > 0.9


def test_a_curve_that_is_ahead_by_less_than_is_asked_leads_before_it_is_the_answer(outcome):
    programs = WithCurve(["unknown"] * 9, 1.0, {})
    programs.curve = 0.22
    found = outcome(programs)
    assert (found["verdict"], found["confirmed"], len(found["rounds"])) == ("unknown", True, 3)
    assert [r["leader"] for r in found["rounds"]] == ["", "none", "unknown"]


@pytest.mark.parametrize("curve", [0.3, 0.35], ids=["as well", "a little worse"])
def test_a_curve_that_predicts_no_better_keeps_no_name_from_being_confirmed(outcome, curve):
    programs = WithCurve(["unknown"] * 9, 1.0, {})
    programs.curve = curve
    found = outcome(programs)
    assert (found["verdict"], found["confirmed"], len(found["rounds"])) == ("named", True, 2)
    assert [e["name"] for e in found["effects"]] == ["stribeck"]


def test_what_the_search_names_is_not_confirmed_while_a_curve_has_refuted_its_form():
    bets = {"none": [5.0] * 20, "unknown": [-1.0] * 20}
    common = ("slow", "why", "rounds/02", Cost(), "stribeck:1", 6.0, {})
    last = Round(*common, bets, {}, "named", "stribeck:1")
    assert borne_out([last]) == ""
    assert borne_out([replace(last, bets=bets | {"unknown": [-0.1] * 20})]) == "stribeck:1"


def test_an_effect_that_might_be_none_in_another_form_is_not_confirmed(outcome):
    programs = WithCurve(["unknown"] * 9, 1.0, {})
    programs.curve, programs.unsettled = 0.3, ("stribeck:1",)
    found = outcome(programs)
    assert (found["verdict"], found["confirmed"], len(found["rounds"])) == ("ambiguous", False, 4)


def test_a_suspect_beside_structure_that_no_effect_explains_is_not_named(outcome):
    programs = AllSuspected(["unknown"] * 9, 1.0, {})
    programs.unexplained = ({"joint": 1},)
    found = outcome(programs)
    assert (found["verdict"], found["confirmed"], len(found["rounds"])) == ("unknown", True, 2)


def test_a_suspect_that_beats_no_effect_but_not_its_rival_is_ambiguous():
    bets = {"none": [5.0] * 20, "joint_spring:1": [0.1] * 20}
    common = ("slow", "why", "rounds/04", Cost(), "stribeck:1", 6.0, {}, bets, {})
    last = Round(*common, "no_gap", "", {}, suspected=("stribeck:1",))
    found = ended([last], "motions is 3 of 3")
    assert (found.verdict, found.confirmed) == ("ambiguous", False)
    assert "stribeck at joint 1 predicted the motions better than no effect" in found.sentence


def test_a_suspect_that_predicts_no_better_is_not_named(outcome):
    programs = Suspecting(["no_gap"] * 9, 1.0, {})
    programs.left = 1.5
    found = outcome(programs)
    assert (found["verdict"], found["confirmed"], len(found["rounds"])) == ("no_gap", True, 2)


BUS_FAULT = ProgramError("wamctl excite", 4, "Bus socketcan:can0 is off: the arm was braked")


@pytest.mark.parametrize("end", [KeyboardInterrupt(), BUS_FAULT], ids=["kill", "bus fault"])
@pytest.mark.parametrize("call", range(1, 8))
def test_an_investigation_cut_short_goes_on_to_the_same_result(outcome, call, end):
    whole = outcome(Programs(["named", "named"], 5.0, {}), "whole")
    programs = Programs(["named", "named"], 5.0, {call: end})
    with pytest.raises(type(end)):
        outcome(programs, "cut short")
    resumed = outcome(programs, "cut short", resume=True)
    assert len(programs.calls) == 8  # the one that was cut short, once more
    assert resumed | {"wall_s": 0.0} == whole | {"wall_s": 0.0}


def test_a_motion_that_a_limit_ends_is_evidence_and_counts(outcome):
    stop = ProgramError("wamctl excite", 5, "joint 4 was 0.6 rad from its reference")
    found = outcome(Programs(["named", "named"], 5.0, {4: stop}))
    assert found["rounds"][1]["stopped"] == "joint 4 was 0.6 rad from its reference"
    assert found["budget"]["used"]["stops"] == 1
    assert found["verdict"] == "named"


def test_the_operators_stop_ends_it_and_it_can_be_resumed(outcome, tmp_path):
    stop = ProgramError("wamctl excite", 5, "the operator pressed a key")
    programs = Programs(["named", "named"], 5.0, {4: stop})
    with pytest.raises(ProgramError) as raised:
        outcome(programs)
    assert raised.value.exit_code == 5
    assert outcome(programs, resume=True)["verdict"] == "named"
    kept = tmp_path / "out" / "rounds" / "02" / "slow-ended-1.mcap"
    assert kept.read_text() == "part of a log"


def test_a_budget_that_is_used_up_ends_it(outcome):
    found = outcome(Programs(["named"] * 4, 5.0, {}), motion_s=40.0)
    assert (found["verdict"], len(found["rounds"])) == ("ambiguous", 1)
    assert "motion_s is 50 of 40" in found["why"]


def test_a_motion_that_does_not_fit_into_the_budget_is_not_begun(outcome):
    programs = Programs(["named"] * 4, 5.0, {})
    found = outcome(programs, motion_s=105.0)
    assert (found["verdict"], found["confirmed"], len(found["rounds"])) == ("ambiguous", False, 1)
    assert "with the next motion motion_s is 110 of 105" in found["why"]
    assert programs.calls == ["excite", "gap", "plan"]


def test_the_budget_is_looked_at_after_the_slow_run_and_a_larger_one_goes_on(outcome):
    programs = Programs(["named"] * 4, 5.0, {})
    found = outcome(programs, energy_j=40.0)  # 20 J a run, and none were expected of the next
    assert "with the next motion energy_j is 40 of 40" in found["why"]
    assert programs.calls == ["excite", "gap", "plan", "excite"]
    assert outcome(programs, resume=True)["confirmed"]
    assert programs.calls[4:] == ["excite", "gap", "weigh"]


def test_it_is_not_begun_over_another_one(outcome):
    outcome(Programs(["no_gap"] * 2, 1.0, {}))
    with pytest.raises(UsageError, match="go on with --resume"):
        outcome(Programs(["no_gap"] * 2, 1.0, {}))


@pytest.mark.parametrize(("text", "seconds"), [("10min", 600.0), ("90 s", 90.0), ("1.5h", 5400.0)])
def test_durations(text, seconds):
    assert duration_s(text) == seconds


def test_bounds_that_are_none():
    with pytest.raises(UsageError, match="--budget is a time above zero"):
        duration_s("soon")
    with pytest.raises(UsageError, match="names are wall_s, motion_s"):
        limited(Budget(), ["joules=3"])
    assert limited(Budget(), ["stops=0"]).stops == 0


def test_a_program_that_fails_is_told_with_its_exit_code(tmp_path):
    with pytest.raises(
        ProgramError, match=r"nothing\.mcap.*\(ident gap; --resume goes on\)"
    ) as raised:
        call("ident.cli", ["gap", str(tmp_path / "nothing.mcap"), "--out", str(tmp_path / "gap")])
    assert raised.value.exit_code == 6
