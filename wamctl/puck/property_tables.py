"""Property numbers by firmware version, as libbarrett's `property_list.cpp` lists them.

Only those that this program reads or sets. One line a property: its name, then `FIRST-LAST:id` or
`FIRST+:id` for the firmware versions in which it has that id. A version without an entry does not
know the property.
"""

COMMON = """
VERS     32+:0
ROLE     32+:1
SN       32+:2
ID       32+:3
ERROR    32+:4
STAT     32+:5
ADDR     32+:6
VALUE    32+:7
MODE     32+:8
TEMP     32-60:39 61+:9
GRPA     32-60:51 61+:26
GRPB     32-60:52 61+:27
GRPC     32-60:53 61+:28
"""
"""What all Pucks have, from version 61 on under the same ids."""

MOTOR = """
T        32-49:10 50-60:9 61+:42
MT       32-60:16 61+:43
P        32-60:26 61+:48
CTS      32-60:30 61-63:65 64:66 65+:68
PIDX     32-60:54 61-63:67 64:68 65+:70
IPNM     33-35:57 36-60:108 61-64:83 65+:86
POLES    44-60:112 61-64:87 65+:90
IFAULT   32:100 33-35:102 36-60:100
PEN      32:85 33-35:87 36-60:85
TL1      32:92 33-35:94 36-60:92
TL2      32:93 33-35:95 36-60:93
VL1      32:90 33-35:92 36-60:90
VL2      32:91 33-35:93 36-60:91
ZERO     32:55 33-35:56 36-60:55
"""
"""Motor Pucks (nodes 1 to 7), beside what is common."""

SAFETY = """
ZERO    32:55 33-35:56 36-60:55 61+:42
PEN     32:85 33-35:87 36-60:85 61+:43
VL1     32:90 33-35:92 36-60:90 61+:45
VL2     32:91 33-35:93 36-60:91 61+:46
TL1     32:92 33-35:94 36-60:92 61+:47
TL2     32:93 33-35:95 36-60:93 61+:48
IFAULT  32:100 33-35:102 36-60:100 61+:55
"""
"""Safety Puck (node 10), beside what is common; up to version 60 it has the motor Pucks' table."""
