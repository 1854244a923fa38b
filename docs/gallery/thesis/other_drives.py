"""The start-ups of section 4.5: drives with a parameter doubled, and their periods."""

import numpy as np

from gallery.thesis.drive import AFTER, THESIS, Parameters, Period, StartUp, start_ups

DURATIONS = np.round(np.arange(0.05, 1.501, 0.05), 3)
"""Of holds that are tried where the end time alone is to do, or not to do [s]."""
_P = THESIS
CASES = {
    "4.24": (_P, False), "4.25": (_P, True),
    "4.26": (_P._replace(M=0.2), False), "4.27": (_P._replace(M=0.2), True),
    "4.28": (_P._replace(M=0.2, m=2e-3), True),
    "4.29": (_P._replace(k=2e3), False), "4.30": (_P._replace(k=2e3), True),
    "4.31": (_P._replace(k=2e3, m=5e-4), True),
    "4.32": (_P._replace(R=0.02), False), "4.33": (_P._replace(R=0.02), True),
    "4.34": (_P._replace(c=0.4), False), "4.35": (_P._replace(c=0.4), True),
    "4.36": (_P._replace(e=2e-4), False), "4.37": (_P._replace(e=2e-4), True),
    "4.38": (_P._replace(a=2e-3), False), "4.39": (_P._replace(a=2e-3), True),
    "4.40": (_P._replace(m=2e-3), False), "4.41": (_P._replace(m=2e-3, c_b=4.0), True),
    "4.42": (_P._replace(beta_b=2e-6), False), "4.43": (_P._replace(beta_b=2e-6), True),
    "4.44": (_P._replace(c_b=2.0), False),
    "4.45, m = 2 g": (_P._replace(c_b=2.0, m=2e-3), True),
    "4.45, m = 1.3 g": (_P._replace(c_b=2.0, m=1.3e-3), True),
}  # fmt: skip
"""By figure the drive, and whether it has the rule's period."""


def period_of(p: Parameters) -> Period:
    """The hold, its start and end scaled with the time of the critical speed."""
    return Period(p.critical_time, 0.5 * p.critical_time / THESIS.critical_time)


class Ratios:
    """The start-ups of figures 4.24 to 4.45, and what is compared of them."""

    def __init__(self) -> None:
        cases = [(p, period_of(p) if held else None) for p, held in CASES.values()]
        self.runs = dict(zip(CASES, start_ups(cases), strict=True))

    def peak(self, number: str, beside: str) -> float:
        """Ratio of the largest W/e."""
        return self.runs[number].peak[0] / self.runs[beside].peak[0]

    def force(self, number: str, beside: str) -> float:
        """Ratio of the largest driving forces."""
        return self.runs[number].forward_peak[0] / self.runs[beside].forward_peak[0]

    def end(self, number: str) -> float:
        """The balls' mean end position [deg]."""
        return float(self.runs[number].angles.mean())


def holds_of(p: Parameters) -> list[StartUp]:
    """Holds of all ``DURATIONS``, each until 2.5 s after its end."""
    periods = [period_of(p)._replace(duration=float(d)) for d in DURATIONS]
    return [
        start_ups([(p, x)], every=10, duration=round(x.start + x.duration + AFTER, 2))[0]
        for x in periods
    ]


def nearest(p: Parameters) -> tuple[float, StartUp]:
    """The hold that ends nearest to -180 deg, and its duration [s]."""
    runs = holds_of(p)
    best = int(np.argmin([abs(run.angles.mean() + 180.0) for run in runs]))
    return float(DURATIONS[best]), runs[best]
