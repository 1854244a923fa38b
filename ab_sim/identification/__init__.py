"""Identification of scene parameters from recordings of a drive, with intervals.

- ``tables``, ``mapping``: tables of recordings, and the meaning of their columns.
- ``files``, ``checks``: conversion of recordings for the fit; refusal of unusable ones.
- ``measured``: a single recording.
- ``spindle``: profile of the recorded spindle, which simulated runs follow.
- ``forward``: runs under the conditions of a recording, and their derivatives.
- ``colour``: whitening filter for noise that a sensor's low-pass has coloured.
- ``parameters``, ``problem``: free parameters, and residuals over all recordings.
- ``stages``: staged least squares, first without balls, then start angles, then all parameters.
- ``knowledge``: identifiable and unidentifiable directions.
- ``intervals``, ``residuals``: confidence intervals, and tests of the residuals.
- ``missing``, ``changes``: effects that the scene lacks; drives that changed while recorded.
- ``proposals``: choice of the next recording.
- ``run``, ``result``, ``verdict``: the whole procedure, its result and verdict.
"""
