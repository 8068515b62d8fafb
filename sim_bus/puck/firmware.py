"""Property numbers of the simulated Pucks' firmware, by version.

Only properties that the simulation gives a value; after the lists in libbarrett's
`property_list.cpp`. A change says `NAME=id`, or `NAME=` where a version takes a property away.
"""

from collections.abc import Mapping

Changes = tuple[tuple[int, str], ...]

_BOTH: Changes = (
    (32, "VERS=0 ROLE=1 SN=2 ID=3 ERROR=4 STAT=5 ADDR=6 VALUE=7 MODE=8 TEMP=39 OTEMP=40 LOCK=41"),
    (32, "THERM=46 VBUS=47 GRPA=51 GRPB=52 GRPC=53 PIDX=54 T=10 MT=16 P=26 MECH=28 CTS=30"),
    (32, "SAVE=87 LOAD=88 DEF=89 ZERO=55 PEN=85 VL1=90 VL2=91 TL1=92 TL2=93 IFAULT=100"),
    (32, "VOLTL1=94 VOLTL2=95 VOLTH1=96 VOLTH2=97"),
    (33, "SAVE=89 LOAD=90 DEF=91 ZERO=56 PEN=87 VL1=92 VL2=93 TL1=94 TL2=95 IFAULT=102"),
    (33, "VOLTL1=96 VOLTL2=97 VOLTH1=98 VOLTH2=99 JIDX=55 IPNM=57"),
    (36, "SAVE=87 LOAD=88 DEF=89 ZERO=55 PEN=85 VL1=90 VL2=91 TL1=92 TL2=93 IFAULT=100"),
    (36, "VOLTL1=94 VOLTL2=95 VOLTH1=96 VOLTH2=97 JIDX=107 IPNM=108"),
    (44, "POLES=112"),
    (50, "T=9"),
    (61, "TEMP=9 OTEMP=11 LOCK=13 THERM=20 VBUS=21 GRPA=26 GRPB=27 GRPC=28 SAVE=30 LOAD=31 DEF=32"),
)

_MOTOR: Changes = (
    (61, "ZERO= PEN= VL1= VL2= TL1= TL2= IFAULT= VOLTL1= VOLTL2= VOLTH1= VOLTH2="),
    (61, "T=42 MT=43 P=48 MECH=63 CTS=65 PIDX=67 JIDX=82 IPNM=83 POLES=87"),
    (64, "MECH=64 CTS=66 PIDX=68"),
    (65, "MECH=66 CTS=68 PIDX=70 JIDX=85 IPNM=86 POLES=90"),
)

_SAFETY: Changes = (
    (61, "T= MT= P= MECH= CTS= PIDX= JIDX= IPNM= POLES="),
    (61, "ZERO=42 PEN=43 VL1=45 VL2=46 TL1=47 TL2=48 VOLTL1=49 VOLTL2=50 VOLTH1=51 VOLTH2=52"),
    (61, "IFAULT=55"),
)

MONITOR = {
    name: number
    for number, name in enumerate(
        ("VERS", "ROLE", "SN", "ID", "ERROR", "STAT", "ADDR", "VALUE", "LOCK", "SAVE", "LOAD")
    )
}
"""Properties that a Puck answers while its monitor runs."""

_WIDE = frozenset({"P", "MECH", "CTS", "PEN"})


def motor_ids(version: int) -> Mapping[str, int]:
    """Ids of a motor Puck's properties."""
    return _at(version, (*_BOTH, *_MOTOR))


def safety_ids(version: int) -> Mapping[str, int]:
    """Ids of the safety Puck's properties."""
    return _at(version, (*_BOTH, *_SAFETY))


def width(name: str) -> int:
    """Bytes of a property's value in an answer."""
    return 4 if name in _WIDE else 2


def _at(version: int, changes: Changes) -> dict[str, int]:
    ids: dict[str, str] = {}
    for first, change in changes:
        if version >= first:
            ids |= dict(entry.split("=") for entry in change.split())
    return {name: int(number) for name, number in ids.items() if number}
