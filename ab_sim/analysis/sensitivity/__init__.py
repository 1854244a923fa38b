"""What a small change of a scene's numbers makes of a run: exact derivatives.

keys         numbers of a scene by their dotted keys, as they may change
changes      what such a change makes of a system's constants, its start and its profile
plan         and of the steps along the profile
columns      tables with a column for each key
tangents     arrays for the driver that carries changes along with the state
run          the run itself
along        functions of samples and scene, along the samples' derivative
of_readings  accelerometers
of_merits    and of what a run is judged by
"""

from ab_sim.analysis.sensitivity.keys import NoDerivative, real_keys
from ab_sim.analysis.sensitivity.of_merits import MeritSensitivities
from ab_sim.analysis.sensitivity.run import Sensitivities, sensitivities

__all__ = ["MeritSensitivities", "NoDerivative", "Sensitivities", "real_keys", "sensitivities"]
