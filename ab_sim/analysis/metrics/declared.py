"""Metrics of every run, in the order of reports: vibration, motion of balls, settling times."""

from ab_sim.analysis.circulation import Circulation
from ab_sim.analysis.metrics.accumulators import (
    BAND,
    EARLIER,
    FLOOR,
    TURNS,
    BandAccumulator,
    FinalCirculationAccumulator,
    FinalWhirlAccumulator,
    LastSampleAccumulator,
    OncePerTurnAccumulator,
    PassageAccumulator,
    PeakAccumulator,
    ResidualAccumulator,
    RunOverlapAccumulator,
    TiltAccumulator,
    is_start_up,
)
from ab_sim.analysis.metrics.metric import (
    Better,
    Metric,
    MetricKind,
    MetricValues,
    Place,
    Relative,
    Row,
)
from ab_sim.analysis.metrics.spindle import NEAR, SlipAccumulator, TorqueAccumulator
from ab_sim.analysis.metrics.verdict import (
    GradeConclusion,
    SettlingConclusion,
    StartUpConclusion,
    Verdict,
    VerdictConclusion,
)
from ab_sim.analysis.metrics.vibration import HIGHEST, LOWEST, BroadBandAccumulator
from ab_sim.analysis.metrics.wording import (
    SMALL_ANGLE,
    TORQUE,
    VELOCITY,
    angles_text,
    circulating_text,
    final_text,
    in_band_text,
    number_row,
    number_text,
    passage_text,
    peak_text,
    phase_text,
    seconds_text,
    shown_text,
    speed_text,
)
from ab_sim.drive.overlap import WHAT_CHANGES, Overlap, overlaps_text
from ab_sim.scene.model import Scene

_VIBRATION = (
    f"velocity of the deck from {LOWEST:g} to {HIGHEST:g} Hz (ISO 20816-1) at the sensors' "
    "places, along each of their axes; without sensors at C, along x and y, in space also z"
)
_TOO_SPARSE = (
    "null if the once-per-turn vibration is outside this band, or if samples are uneven, or more "
    "than 10 ms or a quarter of a turn apart,"
)
_FILTERED = "v filtered by Butterworth of 4th order, v = v_C + w_deck x r"


def _has_balls(scene: Scene) -> bool:
    return scene.balls.count > 0


class Metrics(MetricValues):
    """Metrics of one run.

    Attributes have whirls in m, velocities in m/s, and None for null; ``report`` and keys have them
    in e and mm/s. Times count from the start of the run unless stated otherwise.
    """

    peak_whirl = Metric[float](
        "peak_whirl_over_e",
        "e",
        "largest whirl; its peak is interpolated between samples",
        "max W(t) / e, W = hypot(x, y); between samples along a cubic through places and "
        "velocities",
        PeakAccumulator,
        lambda peak: peak.peaks.whirl,
        Row("peak {W}", lambda m, display: peak_text(m.peak_whirl, m.peak_time, display)),
        better=Better.SMALLER,
    )
    peak_time = Metric[float](
        "peak_time",
        "s",
        "time of the largest whirl",
        "t of max W(t)",
        PeakAccumulator,
        lambda peak: peak.peaks.time,
    )
    final_whirl = Metric[float](
        "final_whirl_over_e",
        "e",
        "root mean square of the whirl over the last tenth of the run",
        "sqrt(mean(W^2)) / e over t >= t_l, t_l the beginning of the last tenth",
        FinalWhirlAccumulator,
        lambda final: final.mean_squares.values,
        Row(
            "final {W}",
            lambda m, display: final_text(m.final_whirl, m.halves, m.settled, display),
        ),
        relative=Relative("final_whirl_relative_to_no_balls", "... / without balls"),
        better=Better.SMALLER,
    )
    settled = Metric[bool](
        "settled",
        "-",
        "whether the whirl does not change any more over the last stretch: it neither rises nor "
        f"falls by a tenth of itself or more, or it is within {100 * FLOOR:g} % of M0 e / M",
        f"W_f <= {100 * FLOOR:g} % M0 e / M, or not all of these changes within t >= t_l occur in "
        "one direction: sqrt(mean(W^2)) by more than 10 % from the first to the last third and by "
        "more than 5 % from half to half, max W by more than 10 % from the first to the last third",
        FinalWhirlAccumulator,
        lambda final: final.settled,
        better=Better.LARGER,
        kind=MetricKind.TRUTH,
    )
    halves = Metric[tuple[float, float]](
        "final_whirl_of_halves",
        "-",
        "root mean square of the whirl over both halves of the last tenth [m]",
        "sqrt(mean(W^2)) over each half of t >= t_l",
        FinalWhirlAccumulator,
        lambda final: final.halves,
        reported=False,
        kind=MetricKind.STRUCTURE,
    )
    span = Metric[tuple[float, float]](
        "final_whirl_span",
        "-",
        "least and largest whirl of the last tenth [m]",
        "(min W, max W) over t >= t_l",
        FinalWhirlAccumulator,
        lambda final: final.span,
        reported=False,
        kind=MetricKind.STRUCTURE,
    )
    band = Metric[float](
        "band_over_e",
        "e",
        f"half-width of the band around the final whirl: {100 * BAND:g} % of it, at least "
        f"{100 * FLOOR:g} % of M0 e / M",
        f"max({100 * BAND:g} % W_f, {100 * FLOOR:g} % M0 e / M) / e, W_f = sqrt(mean(W^2)) "
        "over t >= t_l",
        FinalWhirlAccumulator,
        lambda final: final.band,
    )
    in_band_from = Metric[float | None](
        "in_band_from",
        "s",
        "time from which the whirl stays within band_over_e of its final value; null if it "
        "leaves that band in the last tenth of the run, or has not settled",
        "first t_k with abs(W(t_j) - W_f) <= band for all j >= k; null if t_k > t_l or not settled",
        BandAccumulator,
        lambda band: band.times,
        Row(
            "in the band",
            lambda m, display: in_band_text(m.in_band_from, m.band, m.span, display),
            place=Place.COURSE,
        ),
        better=Better.SMALLER,
        stepwise=True,
        of_balanced=True,
    )
    once_per_turn = Metric[float | None](
        "once_per_turn_over_e",
        "e",
        "amplitude of the once-per-turn part of the whirl, over the last tenth of the run; null if "
        f"that has fewer than {TURNS} turns, or samples more than a quarter of a turn apart",
        "abs(U) / e, U = sum h_k (x_k + i y_k) exp(-i psi_k) over t >= t_l, h Hann's window, "
        "sum h_k = 1",
        OncePerTurnAccumulator,
        lambda once: once.size,
        better=Better.SMALLER,
    )
    phase = Metric[float | None](
        "phase",
        "rad",
        "angle from the unbalance to the once-per-turn part of the displacement, -pi to pi, "
        "in the direction of growing angles: near 0 far below the critical speed, near +-pi "
        "far above it; null without such a part",
        "arg(U)",
        OncePerTurnAccumulator,
        lambda once: once.phase,
        Row("phase of W", lambda m, display: phase_text(m.phase, display), place=Place.END),
    )
    residual_unbalance = Metric[float | None](
        "residual_unbalance",
        "1",
        "abs(M0 e + sum m R exp(i theta)) / (M0 e) over the last stretch: 0 is balanced; null "
        "without an unbalance",
        "sqrt(mean(abs(1 + sum m_i R exp(i theta_i) / (M0 e))^2)) over t >= t_l",
        ResidualAccumulator,
        lambda residual: residual.unbalance.shares,
        Row("residual unbalance", lambda m, _: number_text(m.residual_unbalance), _has_balls),
        better=Better.SMALLER,
    )
    residual_couple = Metric[float | None](
        "residual_couple",
        "1",
        "abs(C + sum m R z exp(i theta)) / abs(C) over the last stretch, z the height of a ball's "
        "race, C the rotor's integral of (x + i y) z dm; null in the plane, and where C = 0",
        "sqrt(mean(abs(1 + sum m_i R z_i exp(i theta_i) / C)^2)) over t >= t_l",
        ResidualAccumulator,
        lambda residual: residual.couple.shares,
        Row(
            "residual couple",
            lambda m, _: number_text(m.residual_couple),
            lambda scene: _has_balls(scene) and scene.couple_unbalance != 0,
        ),
        better=Better.SMALLER,
    )
    peak_tilt = Metric[float | None](
        "peak_tilt",
        "rad",
        "largest angle between the shaft and its direction at rest; null in the plane",
        "max angle(n, n_0), n the shaft's direction, n_0 at rest",
        TiltAccumulator,
        lambda tilt: tilt.peak,
        number_row("peak tilt", lambda m: m.peak_tilt, SMALL_ANGLE),
        better=Better.SMALLER,
    )
    final_tilt = Metric[float | None](
        "final_tilt",
        "rad",
        "root mean square of the shaft's tilt over the last tenth of the run; null in the plane",
        "sqrt(mean(angle(n, n_0)^2)) over t >= t_l",
        TiltAccumulator,
        lambda tilt: tilt.final,
        number_row("final tilt", lambda m: m.final_tilt, SMALL_ANGLE),
        better=Better.SMALLER,
    )
    first_passage_of_opposite = Metric[float | None](
        "first_passage_of_opposite",
        "s",
        "time at which all balls first have theta <= -180 deg; null if they never do, without "
        "balls, and for profiles other than a start-up",
        "first t with theta_i <= -pi for all i, between samples along cubics",
        PassageAccumulator,
        lambda passage: passage.times,
        Row(
            "all at -180 deg",
            lambda m, _: passage_text(m.first_passage_of_opposite, len(m.final_ball_angles)),
            lambda scene: _has_balls(scene) and is_start_up(scene),
            Place.COURSE,
            in_reports=False,
        ),
    )
    final_ball_angles = Metric[tuple[float, ...]](
        "final_ball_angles",
        "rad",
        "angle of each ball from the unbalance, unwrapped, at the end of the run",
        "theta_i at the last sample",
        LastSampleAccumulator,
        lambda last: last.ball_angles,
        Row(
            "final ball angles",
            lambda m, display: angles_text(m.final_ball_angles, m.circulating, display),
            place=Place.COURSE,
        ),
        plain=list,
        kind=MetricKind.STRUCTURE,
    )
    final_speed = Metric[float](
        "final_speed",
        "rad/s",
        "spindle speed at the end of the run",
        "w at the last sample",
        LastSampleAccumulator,
        lambda last: last.speed,
        Row(
            "final speed",
            lambda m, display: speed_text(m.final_speed, display),
            place=Place.END,
            in_reports=False,
        ),
    )
    circulating = Metric[Circulation | None](
        "circulating_balls",
        "-",
        "balls that circulate in the race during the last tenth of the run: their numbers, their "
        "mean speeds and the spindle's [rad/s]; null if none does",
        "balls that turn relative to the race by 2 pi or more in one direction in each third of "
        "t >= t_l, and in the last third at 90 % or more of their speed in the first",
        FinalCirculationAccumulator,
        lambda accumulator: accumulator.circulations,
        Row(
            "balls circulate",
            lambda m, display: circulating_text(m.circulating, len(m.final_ball_angles), display),
            place=Place.COURSE,
            note="Balls circulate: they go round the race, steadily, as long as the run lasts, and "
            "do not balance the rotor; their speed is absolute, in the mean over the last stretch.",
        ),
        plain=lambda value: value and value.report(),
        kind=MetricKind.STRUCTURE,
    )
    overlaps = Metric[tuple[Overlap, ...] | None](
        "overlapping_balls",
        "-",
        "pairs of balls that overlapped, which the effect ball_contact prevents, and the time "
        "of the first overlap [s]; null if none can overlap",
        "2 R abs(sin((theta_i - theta_j) / 2)) < a_i + a_j at a sample, or ball i passes ball j "
        "between samples; i and j on one race",
        RunOverlapAccumulator,
        lambda accumulator: accumulator.overlaps,
        Row(
            "balls overlap",
            lambda m, _: overlaps_text(m.overlaps),
            place=Place.COURSE,
            caution=f"balls overlap: {WHAT_CHANGES}",
        ),
        plain=lambda bunches: None if bunches is None else [bunch._asdict() for bunch in bunches],
        kind=MetricKind.STRUCTURE,
    )
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
        Row("start-up takes", lambda m, _: seconds_text(m.start_up_time), place=Place.COURSE),
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
        lambda settling: settling.periods,
    )
    peak_motor_torque = Metric[float | None](
        "peak_motor_torque",
        "N m",
        "largest magnitude of the motor's torque at any sample; null without the effect "
        "motor, because the speed is then prescribed",
        "max abs(T)",
        TorqueAccumulator,
        lambda torque: torque.largest,
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
        lambda vibration: vibration.each("final"),
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
        lambda vibration: vibration.each("reason_without_value"),
        kind=MetricKind.WORDS,
    )
    velocity_rms = Metric[float](
        "velocity_rms",
        "mm/s",
        "vibration_velocity_rms without its filters, for all frequencies",
        "max over axes of sqrt(mean(v^2)) over t >= t_l, v = v_C + w_deck x r",
        BroadBandAccumulator,
        lambda vibration: vibration.each("whole"),
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
        lambda vibration: vibration.each("peak"),
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
        lambda grade: grade.grades,
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
        lambda verdict: verdict.verdicts,
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
