"""Identification of scene parameters from recordings of a drive, with intervals.

- ``files``, ``tables``, ``mapping``: selected recordings, their tables, the meaning of columns.
- ``inputs``, ``checks``: conversion of recordings for the fit; refusal of unusable ones.
- ``measured``: a single recording.
- ``speed_profile``: profile of the recorded spindle, which simulated runs follow.
- ``runs``, ``forward``: runs under the conditions of a recording, and their derivatives.
- ``colour``: whitening filter for noise that a sensor's low-pass has coloured.
- ``parameters``, ``problem``: free parameters, and residuals over all recordings.
- ``stages``: staged least squares, first without balls, then start angles, then all parameters.
- ``knowledge``: identifiable and unidentifiable directions.
- ``intervals``, ``residuals``: confidence intervals, and tests of the residuals.
- ``missing``, ``holding_out``: effects that the scene lacks; validation on other recordings.
- ``proposals``: choice of the next recording.
- ``run``, ``result``: the whole procedure, and its result.
"""
