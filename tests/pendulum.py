"""A double pendulum about horizontal axes, angles from hanging: for what is derived by hand."""

M1, M2 = 2.0, 1.5
"""Masses of the links [kg]."""

I1, I2 = 0.03, 0.012
"""Inertias about the joints' axes, at the centres of mass [kg m^2]."""

A1, C1, C2 = 0.5, 0.2, 0.15
"""From shoulder to elbow, and from each joint to its link's centre of mass [m]."""

G = 9.81


def pendulum(reach: float = 3.0, speed: float = 5.0, aside: tuple[float, float] = (0, 0)) -> str:
    """Its URDF.

    Args:
        reach: limit of the joints' positions to both sides [rad].
        speed: limit of their velocities [rad/s].
        aside: x of the centres of mass [m].
    """
    limit = f'<limit lower="{-reach}" upper="{reach}" velocity="{speed}" effort="50"/>'
    return f"""<robot name="pendulum">
  <link name="base"/>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <axis xyz="0 1 0"/>{limit}</joint>
  <link name="upper"><inertial><origin xyz="{aside[0]} 0 {-C1}"/><mass value="{M1}"/>
    <inertia ixx="0.02" iyy="{I1}" izz="0.015" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/>
    <origin xyz="0 0 {-A1}"/><axis xyz="0 1 0"/>{limit}</joint>
  <link name="lower"><inertial><origin xyz="{aside[1]} 0 {-C2}"/><mass value="{M2}"/>
    <inertia ixx="0.01" iyy="{I2}" izz="0.004" ixy="0" ixz="0" iyz="0"/></inertial></link>
</robot>"""
