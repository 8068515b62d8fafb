"""The work of `ident watch`, from a source to alarms."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ident.effects.bound_effects import load_model
from ident.fleet.metadata import iso
from ident.recordings.loading import Reading
from ident.report.fleet.watch_page import watch_page
from ident.report.page import render
from ident.watch.residual import Residual
from ident.watch.samples import Sampler
from ident.watch.settings import DEFAULT, WatchSettings
from ident.watch.sources import messages
from ident.watch.watcher import Alarm, Watcher
from wamctl.arm.errors import DataError, write_text


def watched(
    source: str,
    model_path: Path,
    reading: Reading,
    idle_s: float,
    settings: WatchSettings = DEFAULT,
    report: Path | None = None,
) -> Iterator[dict[str, Any]]:
    """What is to be told, as it happens; last, how long was watched.

    Args:
        source: an MCAP file that may still be written, `-`, or a ws:// address.
        model_path: a `model.yaml` that is trusted.
        reading: topics and torque to read.
        idle_s: a file that has not grown for so long has ended [s].
        settings: of the watch.
        report: page to be written at each alarm and at the end.

    Raises:
        DataError: a source or a model that cannot be used, or a page that cannot be written.
    """
    lines: list[dict[str, Any]] = []
    for line in _told(source, model_path, reading, idle_s, settings):
        lines.append(line)
        if report is not None:
            write_text(report, render(watch_page(source, lines)))
        yield line


def _told(
    source: str, model_path: Path, reading: Reading, idle_s: float, settings: WatchSettings
) -> Iterator[dict[str, Any]]:
    """As above, without the page."""
    model = load_model(model_path)
    if not np.isfinite(model.noise[model.moving]).all():
        raise DataError(f"{model_path} does not say how well it fits: make it with `ident run`.")
    residual = Residual(model, settings)
    watcher = Watcher(model, residual, settings)
    topics = reading.joint_states, reading.joint_commands
    delay_s = model.filter.delay_s
    sampler = Sampler(model.robot.joint_names, topics, reading.torque, source, delay_s)
    moved = told = 0
    for samples in sampler.samples(messages(source, topics, idle_s)):
        for window in residual.windows(samples):
            moved += window.moving
            alarm = watcher.look(window)
            if alarm is not None:
                told += 1
                yield alarm_content(alarm)
    yield {"kind": "end", "alarms": told, "motion_s": moved * settings.window_s}


def alarm_content(alarm: Alarm) -> dict[str, Any]:
    """An alarm as a line of JSON has it."""
    content: dict[str, Any] = {
        "kind": alarm.kind,
        "since": iso(alarm.since_ns),
        "told": iso(alarm.told_ns),
        "since_ns": alarm.since_ns,
        "told_ns": alarm.told_ns,
        "joints": list(alarm.joints),
        "evidence": alarm.evidence,
        "parameters": {name: vars(size) for name, size in alarm.parameters.items()},
        "rival": alarm.rival,
    }
    known = alarm.parameters
    if alarm.kind == "payload" and known["mass"].value > known["mass"].sd:
        moments = (known[f"first_moment_{a}"].value for a in "xyz")
        content["centre_m"] = [moment / known["mass"].value for moment in moments]
    return content
