"""CiA 402: states by statusword, commands towards a goal."""

import pytest

from wamctl.canopen import ds402
from wamctl.canopen.ds402 import Controlword, Goal, State

# Statusword as a drive sends it, other bits included, by the table of states.
TABLE = [
    (0x0000, State.NOT_READY_TO_SWITCH_ON),
    (0x0250, State.SWITCH_ON_DISABLED),
    (0x0270, State.SWITCH_ON_DISABLED),
    (0x0231, State.READY_TO_SWITCH_ON),
    (0x0233, State.SWITCHED_ON),
    (0x1237, State.OPERATION_ENABLED),
    (0x0217, State.QUICK_STOP_ACTIVE),
    (0x021F, State.FAULT_REACTION_ACTIVE),
    (0x0218, State.FAULT),
    (0x0238, State.FAULT),
]


@pytest.mark.parametrize(("word", "expected"), TABLE)
def test_a_statusword_shows_its_state(word, expected):
    assert ds402.state(word) is expected


def test_bits_that_no_state_has_show_none():
    assert ds402.state(0x0002) is None


@pytest.mark.parametrize("other", [0x0080, 0x0400, 0x0800, 0x8000])
def test_other_bits_do_not_matter(other):
    assert all(ds402.state(word | other) is state for word, state in TABLE)


def walk(start, goal):
    """Commands and states on the way, for a drive that follows every command."""
    follows = {
        (State.SWITCH_ON_DISABLED, Controlword.SHUTDOWN): State.READY_TO_SWITCH_ON,
        (State.READY_TO_SWITCH_ON, Controlword.SWITCH_ON): State.SWITCHED_ON,
        (State.SWITCHED_ON, Controlword.ENABLE_OPERATION): State.OPERATION_ENABLED,
    }
    state, commands = start, []
    for _ in range(6):
        command = ds402.controlword(state, goal)
        commands.append(command)
        if command is Controlword.DISABLE_VOLTAGE and state is not State.FAULT:
            state = State.SWITCH_ON_DISABLED
        state = follows.get((state, command), state)
    return commands, state


def test_the_way_to_enabled():
    commands, state = walk(State.SWITCH_ON_DISABLED, Goal.ENABLED)
    assert commands[:4] == [0x06, 0x07, 0x0F, 0x0F]
    assert state is State.OPERATION_ENABLED


@pytest.mark.parametrize("start", [s for s in State if s is not State.FAULT])
def test_the_way_to_disabled_is_one_command(start):
    commands, state = walk(start, Goal.DISABLED)
    assert set(commands) == {Controlword.DISABLE_VOLTAGE}
    assert state is State.SWITCH_ON_DISABLED


@pytest.mark.parametrize("goal", list(Goal))
@pytest.mark.parametrize("state", [State.FAULT, State.FAULT_REACTION_ACTIVE, None])
def test_a_faulty_drive_is_never_reset_on_the_way(goal, state):
    assert ds402.controlword(state, goal) is Controlword.DISABLE_VOLTAGE
