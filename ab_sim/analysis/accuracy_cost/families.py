"""Methods and settings for a scene's study, and the reasons for omitted ones."""

import importlib.util
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache, partial

from ab_sim.analysis.accuracy_cost.cvode_peer import cvode_solvers
from ab_sim.analysis.accuracy_cost.methods import MeasuredMethod
from ab_sim.analysis.accuracy_cost.mujoco_peer import MuJoCo, mujoco_refusal
from ab_sim.analysis.accuracy_cost.ours import OwnStepper
from ab_sim.analysis.accuracy_cost.results import OmittedMethod
from ab_sim.analysis.accuracy_cost.right_hand_side import RightHandSide
from ab_sim.analysis.accuracy_cost.sampling import SampleTimes
from ab_sim.analysis.accuracy_cost.scipy_peers import SCIPY
from ab_sim.analysis.accuracy_cost.tolerance import ByTolerance, LegSolver
from ab_sim.base.errors import SceneError
from ab_sim.engine.integrate.choose import choose_stepper
from ab_sim.engine.integrate.registry import steppers
from ab_sim.model.dynamics.assemble import system_of
from ab_sim.model.dynamics.system import has_events
from ab_sim.scene.load import with_solver
from ab_sim.scene.model import Scene

TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-13)
FINER = (5e-5, 2e-5, 1e-5, 5e-6, 2e-6, 1e-6)
"""Shorter steps than requested [s], for a stepper that is unstable at the requested ones."""
LEAST_STEPS = 3
EXTRA = "not installed; pip install 'ab_sim[peers]'"

Setting = tuple[str, Callable[[], MeasuredMethod]]
"""Name of a setting, and its factory."""
Family = tuple[str, Sequence[Setting]]
"""Name of a method, and its settings from coarse to fine."""


def all_families(
    scene: Scene,
    sampling: SampleTimes,
    f: RightHandSide | None,
    with_energy_balance: bool,
    steps: Sequence[float],
    tolerances: Sequence[float],
) -> tuple[list[Family], list[OmittedMethod]]:
    """Return all methods for a scene, and those that cannot run it.

    Args:
        scene: the scene.
        sampling: times at which runs are compared.
        f: the scene as a right-hand side; None if it has events.
        with_energy_balance: whether the scene can keep an energy balance.
        steps: steps to try [s].
        tolerances: relative tolerances to try.
    """
    divides = [step for step in steps if sampling.per_period(step)]
    missing = [
        OmittedMethod(f"steps of {1e3 * step:g} ms",
                      f"do not divide {sampling.period:g} s, at which runs are compared")
        for step in steps
        if step not in divides
    ]  # fmt: skip
    families = [*_ours(scene, sampling, divides)]
    if f is None:
        missing += [OmittedMethod(name, _events_reason(scene)) for name in (*SCIPY, "CVODE")]
    else:
        tolerances = sorted(tolerances, reverse=True)
        families += _by_tolerance(f, with_energy_balance, tolerances, missing)
    families += _mujoco(scene, sampling, divides, missing)
    return families, missing


def _ours(scene: Scene, sampling: SampleTimes, steps: Sequence[float]) -> Iterator[Family]:
    """Yield every registered stepper with its settings."""
    own_steps = [scene.solver.step] if sampling.per_period(scene.solver.step) else []
    ladder = sorted({*steps, *own_steps}, reverse=True)
    for name in steppers():
        settings = [
            (f"{1e3 * step:g} ms", partial(OwnStepper, scene, sampling, name, step))
            for step in ladder
        ]
        longest = _longest(scene, name, ladder[-1] if ladder else FINER[-1])
        allowed = sum(step <= longest for step in ladder)
        finer = [s for s in FINER if s <= longest and sampling.per_period(s)]
        if allowed < LEAST_STEPS:
            settings += [
                (f"{1e3 * step:g} ms", partial(OwnStepper, scene, sampling, name, step))
                for step in finer[: LEAST_STEPS - allowed]
            ]
        yield name, settings


def _longest(scene: Scene, stepper: str, step: float) -> float:
    """Return the longest step that a stepper may take in a scene [s]."""
    for shorter in (step, *FINER):
        candidate = with_solver(scene, stepper, shorter)
        try:
            return choose_stepper(candidate, system_of(candidate)).longest
        except SceneError:
            continue
    return 0.0


def _by_tolerance(
    f: RightHandSide,
    with_energy_balance: bool,
    tolerances: Sequence[float],
    missing: list[OmittedMethod],
) -> list[Family]:
    """Return SciPy's integrators and CVODE; append CVODE to ``missing`` if not installed."""
    solvers: dict[str, LegSolver] = dict(SCIPY)
    try:
        solvers.update(cvode_solvers())
    except ImportError:
        missing.append(OmittedMethod("CVODE", f"scikit-sundae is {EXTRA}"))
    # Compiled once, when the first method needs it.
    f_balance = (
        lru_cache(partial(RightHandSide, f.scene, f.sampling, True))
        if with_energy_balance
        else None
    )
    return [
        (
            name,
            [
                (f"rtol {rtol:g}", partial(ByTolerance, f, f_balance, name, solver, rtol))
                for rtol in tolerances
            ],
        )
        for name, solver in solvers.items()
    ]


def _mujoco(
    scene: Scene, sampling: SampleTimes, steps: Sequence[float], missing: list[OmittedMethod]
) -> list[Family]:
    refusal = mujoco_refusal(scene)
    if not refusal and importlib.util.find_spec("mujoco") is None:
        refusal = f"MuJoCo is {EXTRA}"
    if refusal:
        missing.append(OmittedMethod(MuJoCo.name, refusal))
        return []
    ladder = sorted(steps, reverse=True)
    settings = [(f"{1e3 * step:g} ms", partial(MuJoCo, scene, sampling, step)) for step in ladder]
    return [(MuJoCo.name, settings)]


def _events_reason(scene: Scene) -> str:
    names = [name for name, e in scene.effects.items() if has_events((e,))]
    return (
        f"{', '.join(names)}: forces switch at events, which this study does not let it locate; "
        "across kinks of the right-hand side every method falls to first order"
    )
