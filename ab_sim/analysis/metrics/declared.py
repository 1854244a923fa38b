"""Metrics of every run: residual vibration, settling times and others.

Each metric is declared either here or in ``declared_motion``, in the order of reports.
"""

from ab_sim.analysis.metrics.accumulators import EARLIER, FinalCirculationAccumulator
from ab_sim.analysis.metrics.conclusions import (
    GradeConclusion,
    SettlingConclusion,
    StartUpConclusion,
    VerdictConclusion,
)
from ab_sim.analysis.metrics.declared_motion import MotionMetrics
from ab_sim.analysis.metrics.metric import Better, Metric, MetricKind, Place, Row
from ab_sim.analysis.metrics.spindle import NEAR, SlipAccumulator, TorqueAccumulator
from ab_sim.analysis.metrics.verdict import Verdict
from ab_sim.analysis.metrics.vibration import HIGHEST, LOWEST, BroadBandAccumulator
from ab_sim.analysis.metrics.wording import (
    TORQUE,
    VELOCITY,
    number_row,
    seconds_text,
    shown_text,
)

_VIBRATION = (
    f"velocity of the deck from {LOWEST:g} to {HIGHEST:g} Hz (ISO 20816-1) at the sensors' "
    "places, along each of their axes; without sensors at C, along x and y, in space also z"
)
_TOO_SPARSE = (
    "null if the once-per-turn vibration is outside this band, or if samples are uneven, or more "
    "than 10 ms or a quarter of a turn apart,"
)
_FILTERED = "v filtered by Butterworth of 4th order, v = v_C + w_deck x r"


class Metrics(MotionMetrics):
    """Metrics of one run.

    Attributes have whirls in m, velocities in m/s, and None for null; ``report`` and keys have them
    in e and mm/s. Times count from the start of the run unless stated otherwise.
    """

    in_band_after_start = Metric[float | None](
        "in_band_after_start",
        "s",
        "in_band_from, counted from the first change of the requested speed; null if "
        "in_band_from is null, or if that speed never changes",
        "max(in_band_from - t_s, 0), t_s the last sample before the command first changes",
        StartUpConclusion,
        lambda start_up: start_up.in_band,
        better=Better.SMALLER,
        stepwise=True,
        of_balanced=True,
    )
    start_up_time = Metric[float | None](
        "start_up_time",
        "s",
        "time from the first change of the requested speed until the spindle is within "
        f"{100 * NEAR:g} % of the last requested speed and the whirl stays in its band; null "
        "unless both happen before the last tenth of the run",
        "max(in_band_from, t_t) - t_s; from t_t on the command is w_c and abs(w - w_c) <= "
        f"{100 * NEAR:g} % of the larger of w_c and the first command",
        StartUpConclusion,
        lambda start_up: start_up.ready,
        Row(
            "start-up takes",
            lambda m, _: seconds_text(m.start_up_time),
            place=Place.COURSE,
        ),
        better=Better.SMALLER,
        stepwise=True,
        of_balanced=True,
    )
    settling_period = Metric[float | None](
        "settling_period",
        "s",
        "settling period of the thesis: from the beginning of the variable-speed period, or "
        "without one from the critical speed, until all balls first have theta <= -180 deg; "
        "null if they never do, and for profiles with neither; does not tell whether the "
        "drive is balanced",
        "first_passage_of_opposite - t_p, thesis section 4.4",
        SettlingConclusion,
        lambda settling: settling.found,
    )
    peak_motor_torque = Metric[float | None](
        "peak_motor_torque",
        "N m",
        "largest magnitude of the motor's torque at any sample; null without the effect "
        "motor, because the speed is then prescribed",
        "max abs(T)",
        TorqueAccumulator,
        lambda torque: torque.found,
        number_row("peak motor torque", lambda m: m.peak_motor_torque, TORQUE),
        better=Better.SMALLER,
    )
    vibration_velocity_rms = Metric[float | None](
        "vibration_velocity_rms",
        "mm/s",
        f"root mean square over the last tenth of the {_VIBRATION}; the largest of all axes; "
        f"{_TOO_SPARSE} in that tenth",
        f"max over axes of sqrt(mean(v^2)) over t >= t_l, {_FILTERED}",
        BroadBandAccumulator,
        lambda vibration: vibration.final,
        Row(
            f"rms velocity, {LOWEST:g}-{HIGHEST:g} Hz",
            lambda m, display: (
                m.vibration_velocity_null or shown_text(m.vibration_velocity_rms, VELOCITY, display)
            ),
            quantity=VELOCITY,
        ),
        better=Better.SMALLER,
    )
    vibration_velocity_null = Metric[str | None](
        "vibration_velocity_null",
        "-",
        "reason why vibration_velocity_rms is null; null if it has a value",
        "a text",
        BroadBandAccumulator,
        lambda vibration: vibration.why_not,
        kind=MetricKind.WORDS,
    )
    velocity_rms = Metric[float](
        "velocity_rms",
        "mm/s",
        "vibration_velocity_rms without its filters, for all frequencies",
        "max over axes of sqrt(mean(v^2)) over t >= t_l, v = v_C + w_deck x r",
        BroadBandAccumulator,
        lambda vibration: vibration.whole,
        number_row("rms velocity, unfiltered", lambda m: m.velocity_rms, VELOCITY),
        better=Better.SMALLER,
    )
    vibration_velocity_peak = Metric[float | None](
        "vibration_velocity_peak",
        "mm/s",
        "largest magnitude of the filtered velocity of vibration_velocity_rms in the whole run, at "
        "any sample and along any axis; "
        f"{_TOO_SPARSE} anywhere in the run",
        f"max abs(v), {_FILTERED}",
        BroadBandAccumulator,
        lambda vibration: vibration.peak,
        better=Better.SMALLER,
    )
    balance_grade = Metric[float](
        "balance_grade",
        "mm/s",
        "balance quality grade G of ISO 21940-11 at the final speed: residual unbalance over "
        "the last tenth of the run, divided by the turning mass (M0 and all balls), times "
        "speed; without the couple",
        "G = e_res abs(w), e_res = sqrt(mean(abs(M0 e + sum m_i R exp(i theta_i))^2)) / (M0 + sum "
        "m_i) over t >= t_l, w at the last sample",
        GradeConclusion,
        lambda grade: grade.found,
        number_row("balance grade G", lambda m: m.balance_grade, VELOCITY),
        better=Better.SMALLER,
    )
    slipped_turns_max = Metric[float | None](
        "slipped_turns_max",
        "1",
        "turns of the ball that is farthest from its start angle at the end of the run, "
        "relative to the race; oscillations do not add up; null without balls",
        "max over i of abs(theta_i(end) - theta_i(0)) / (2 pi)",
        SlipAccumulator,
        lambda slip: slip.most,
        better=Better.SMALLER,
    )
    slipped_turns_total = Metric[float | None](
        "slipped_turns_total",
        "1",
        "sum of the turns of all balls relative to the race, as in slipped_turns_max; null "
        "without balls",
        "sum over i of abs(theta_i(end) - theta_i(0)) / (2 pi)",
        SlipAccumulator,
        lambda slip: slip.total,
        better=Better.SMALLER,
    )
    balls_circulate = Metric[bool | None](
        "balls_circulate",
        "-",
        "whether any ball circulates (see circulating_balls); null without balls",
        "circulating_balls is not null",
        FinalCirculationAccumulator,
        lambda accumulator: accumulator.any_ball,
        better=Better.SMALLER,
        kind=MetricKind.TRUTH,
    )
    balanced = Metric[bool | None](
        "balanced",
        "-",
        "whether residual_unbalance is at most the scene's balanced.residual_unbalance "
        "(default 0.1, as rolling friction leaves up to 0.1 in a balanced rotor), no ball "
        "circulates, and the whirl has settled or rings down; residual_couple counts only if "
        "the scene has balanced.residual_couple; null without an unbalance",
        "residual_unbalance <= limit, and no circulating_balls, and (settled or rings down: max W "
        f"over t >= t_l at most that over the {EARLIER} tenths before, and residual_unbalance "
        "does not rise)",
        VerdictConclusion,
        lambda verdict: verdict.balanced,
        better=Better.LARGER,
        kind=MetricKind.TRUTH,
    )
    verdict = Metric[str](
        "verdict",
        "-",
        f"{', '.join(verdict.value for verdict in Verdict)}: the last two without balls or without "
        "an unbalance; if the run rings down, the final whirl is an upper bound",
        "from balanced, settled and circulating_balls",
        VerdictConclusion,
        lambda verdict: verdict.found,
        Row(
            "verdict",
            lambda m, _: m.verdict,
            lambda scene: scene.balls.count > 0,
            place=Place.END,
            note="Balanced: residual unbalance at most balanced.residual_unbalance of the scene "
            "(default 0.1), no ball circulates, and W has settled or rings down: it does not grow, "
            "nor does the residual unbalance.",
        ),
        kind=MetricKind.WORDS,
    )
