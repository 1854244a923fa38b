"""From recordings of a drive to the numbers of its scene, each with an interval.

``inputs`` reads recordings; ``speed_profile`` makes a profile of the recorded spindle speed, which
simulated runs follow; ``forward`` runs and differentiates; ``problem`` is the residual over all
recordings; ``stages`` minimises it; ``knowledge`` says what the recordings can tell at all;
``intervals``, ``residuals`` and ``missing`` say how far to believe the result; ``proposals`` which
recording to make next. ``run`` puts them in order.
"""
