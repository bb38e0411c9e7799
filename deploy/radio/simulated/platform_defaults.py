"""Parameters whose defaults differ between airframes (firmware platform_defaults_cf2.h, platform_defaults_cf21bl.h).

Everything else has the defaults of the recorded table of contents. The Brushless is told by its motors.
"""

from __future__ import annotations

from collections.abc import Mapping

from missions.airframes import Airframe

_BRUSHLESS_MOTOR = 0.19  # [N] stronger than any brushed one
# massThrust 132000 counts/N is for motors of 0.12 N, 3.3 % less than ideal: 8 mm of sag, seen in the recordings.
# Stronger motors need proportionally less: what a user of another airframe has to set in ctrlMel.massThrust.
_MASS_THRUST, _MASS_THRUST_MOTOR = 132000.0, 0.12


def platform_defaults(airframe: Airframe) -> Mapping[str, float]:
    """Defaults by full parameter name."""
    brushless = airframe.motor_thrust_max > _BRUSHLESS_MOTOR
    kp, ki, base = (200.0, 400.0, 30000.0) if brushless else (250.0, 500.0, 36000.0)
    return {
        "posCtlPid.thrustBase": base,
        "pid_rate.roll_kp": kp,
        "pid_rate.pitch_kp": kp,
        "pid_rate.roll_ki": ki,
        "pid_rate.pitch_ki": ki,
        "ctrlMel.mass": airframe.mass,
        "ctrlMel.massThrust": _MASS_THRUST * _MASS_THRUST_MOTOR / airframe.motor_thrust_max,
    }
