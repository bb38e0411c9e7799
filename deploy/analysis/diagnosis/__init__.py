"""Why a flight went as it did: what an engineer of the laboratory would say after a look at the curves.

One kind of fault a file; each looks at the evidence alone, and says nothing unless that is beyond doubt. None reads
what a scenario had planned: a rehearsal's faults are found as those of a real flight are.
"""

from __future__ import annotations

from deploy.analysis.diagnosis.actuators import actuators
from deploy.analysis.diagnosis.batteries import batteries
from deploy.analysis.diagnosis.clocks import clocks
from deploy.analysis.diagnosis.downwash import downwash
from deploy.analysis.diagnosis.dropouts import dropouts
from deploy.analysis.diagnosis.ends import ends
from deploy.analysis.diagnosis.following import following
from deploy.analysis.diagnosis.frames import frames
from deploy.analysis.diagnosis.identities import identities
from deploy.analysis.diagnosis.links import links
from deploy.analysis.diagnosis.oscillation import oscillation
from deploy.analysis.diagnosis.radio import radio
from deploy.analysis.evidence import Evidence
from deploy.analysis.findings import Finding

_DOCTORS = (
    identities,
    actuators,
    batteries,
    links,
    dropouts,
    frames,
    clocks,
    following,
    oscillation,
    downwash,
    radio,
    ends,
)


def diagnose(evidence: Evidence) -> list[Finding]:
    """Every fault that shows, in the order in which one would look for them."""
    return [finding for doctor in _DOCTORS for finding in doctor(evidence)]
