"""ab_sim: an optical disc drive whose spindle carries a ball-type automatic balancer.

This module is the public Python API; each name in ``__all__`` is imported when it is first used.
Also public are ``ab_sim.results`` (the types of results, for annotations) and the functions for
effects of users: ``cos``, ``sin``, ``sqrt``, ``where`` and ``total`` of ``ab_sim.tracing``, and the
methods that ``ab_sim.model.equations.effects`` lists. Everything else is private and may change
with any version.

Examples
--------
>>> import ab_sim
>>> run = ab_sim.simulate(ab_sim.load_scene("thesis-hold", ["balls.mass=0.002", "duration=0.1"]))
>>> run
<OfflineRun: scene thesis-hold, samples 101, time 0 to 0.1 s, W/e at the end ...>
>>> figure = run.plot()

Notes
-----
The packages are described in docs/explanation/architecture.md. Each imports only from those below
it, which ``tests/test_rooms.py`` checks.
"""

from typing import TYPE_CHECKING

from ab_sim.base.version import __version__

if TYPE_CHECKING:
    from ab_sim import results
    from ab_sim.analysis.accuracy_cost import accuracy_cost
    from ab_sim.analysis.effect_cost import effect_cost
    from ab_sim.analysis.metrics.of_run import metrics_of
    from ab_sim.analysis.metrics.registered import register_metric
    from ab_sim.analysis.offline import compare_run
    from ab_sim.api.design import robust, sweep, tune
    from ab_sim.api.extensions import register_effect, register_stepper
    from ab_sim.api.identification import identify
    from ab_sim.api.registrations import temporary_registrations
    from ab_sim.api.resting import (
        branches,
        equilibria,
        floquet,
        follow_floquet,
        modes,
        recovery,
        stability_map,
    )
    from ab_sim.api.runs import (
        resolve_accuracy,
        save_recording,
        simulate,
        write_c,
        write_fmu,
    )
    from ab_sim.api.sizing import size
    from ab_sim.base.errors import AbSimError, DivergedError, InputError, RecordingError, SceneError
    from ab_sim.base.yaml_files import scene_names
    from ab_sim.design.basin import basin
    from ab_sim.design.batch.simulate import simulate_batch
    from ab_sim.design.derivatives import metric_sensitivities, sensitivities
    from ab_sim.design.sweep import open_sweep
    from ab_sim.drive.drive import Drive
    from ab_sim.drive.trajectory import Trajectory
    from ab_sim.record.recording import Recording, open_recording
    from ab_sim.scene.load import load_scene
    from ab_sim.scene.model import Scene
    from ab_sim.show.compare import compare_recording

__all__ = [
    "AbSimError",
    "DivergedError",
    "Drive",
    "InputError",
    "Recording",
    "RecordingError",
    "Scene",
    "SceneError",
    "Trajectory",
    "__version__",
    "accuracy_cost",
    "basin",
    "branches",
    "compare_recording",
    "compare_run",
    "effect_cost",
    "equilibria",
    "floquet",
    "follow_floquet",
    "identify",
    "load_scene",
    "metric_sensitivities",
    "metrics_of",
    "modes",
    "open_recording",
    "open_sweep",
    "recovery",
    "register_effect",
    "register_metric",
    "register_stepper",
    "resolve_accuracy",
    "results",
    "robust",
    "save_recording",
    "scene_names",
    "sensitivities",
    "simulate",
    "simulate_batch",
    "size",
    "stability_map",
    "sweep",
    "temporary_registrations",
    "tune",
    "write_c",
    "write_fmu",
]

# Except `results`, no name may equal that of a module in this package: importing that module would
# replace the public name (`ab_sim.drive.accuracy` is a package). A test checks this.
_MODULES = {
    "analysis.offline": ("compare_run",),
    "analysis.metrics.of_run": ("metrics_of",),
    "analysis.metrics.registered": ("register_metric",),
    "api.design": ("robust", "sweep", "tune"),
    "api.identification": ("identify",),
    "api.extensions": ("register_effect", "register_stepper"),
    "api.registrations": ("temporary_registrations",),
    "api.resting": (
        "branches",
        "equilibria",
        "floquet",
        "follow_floquet",
        "modes",
        "recovery",
        "stability_map",
    ),
    "api.runs": (
        "resolve_accuracy",
        "save_recording",
        "simulate",
        "write_c",
        "write_fmu",
    ),
    "api.sizing": ("size",),
    "design.batch.simulate": ("simulate_batch",),
    "design.basin": ("basin",),
    "design.derivatives": ("metric_sensitivities", "sensitivities"),
    "design.sweep": ("open_sweep",),
    "drive.drive": ("Drive",),
    "drive.trajectory": ("Trajectory",),
    "base.errors": ("AbSimError", "DivergedError", "InputError", "RecordingError", "SceneError"),
    "record.recording": ("Recording", "open_recording"),
    "show.compare": ("compare_recording",),
    "scene.load": ("load_scene",),
    "scene.model": ("Scene",),
    "base.yaml_files": ("scene_names",),
    "analysis.accuracy_cost": ("accuracy_cost",),
    "analysis.effect_cost": ("effect_cost",),
}
"""Module of each public name."""

if not TYPE_CHECKING:

    def __getattr__(name: str) -> object:
        from importlib import import_module

        if name == "results":
            return import_module("ab_sim.results")
        for module, names in _MODULES.items():
            if name in names:
                attribute = getattr(import_module(f"ab_sim.{module}"), name)
                globals()[name] = attribute  # so that this is called only once
                return attribute
        if name.startswith("__"):
            raise AttributeError(f"module 'ab_sim' has no attribute {name!r}")
        from difflib import get_close_matches

        near = get_close_matches(name, __all__, cutoff=0.5)
        hint = f"; did you mean {' or '.join(near)}?" if near else "; dir(ab_sim) lists what it has"
        raise AttributeError(f"module 'ab_sim' has no attribute {name!r}{hint}")


def __dir__() -> list[str]:
    dunders = [name for name in globals() if name.startswith("__")]
    return sorted({*__all__, *dunders})
