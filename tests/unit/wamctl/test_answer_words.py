"""Answers of an investigation as an operator reads them."""

import pytest

from wamctl.investigation.evidence import words


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        ("none", "no effect"),
        ("stribeck:4", "stribeck at joint 4"),
        ("torque_gain:5-6", "torque gain at joints 5 and 6"),
        ("torque_delay:1-2-3-4-5-6-7", "torque delay at joints 1 to 7"),
        ("stribeck:4+torque_delay:2-4", "stribeck at joint 4 and torque delay at joints 2 and 4"),
    ],
)
def test_answers_are_said_in_words(answer: str, said: str) -> None:
    assert words(answer) == said
