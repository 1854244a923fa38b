"""Metrics of the motion of deck and balls; ``declared`` has the others."""

from ab_sim.analysis.circulation import Circulation
from ab_sim.analysis.metrics.accumulators import (
    BAND,
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
from ab_sim.analysis.metrics.wording import (
    SMALL_ANGLE,
    angles_text,
    circulating_text,
    final_text,
    in_band_text,
    number_row,
    number_text,
    passage_text,
    peak_text,
    phase_text,
    speed_text,
)
from ab_sim.drive.overlap import WHAT_CHANGES, Overlap, overlaps_text
from ab_sim.scene.model import Scene

CIRCULATE = (
    "Balls circulate: they go round the race, steadily, as long as the run lasts, and do not "
    "balance the rotor; their speed is absolute, in the mean over the last stretch."
)


def _has_balls(scene: Scene) -> bool:
    return scene.balls.count > 0


class MotionMetrics(MetricValues):
    """Metrics of the motion of deck and balls; see ``declared.Metrics``."""

    peak_whirl = Metric[float](
        "peak_whirl_over_e",
        "e",
        "largest whirl; its peak is interpolated between samples",
        "max W(t) / e, W = hypot(x, y); between samples along a cubic through places and "
        "velocities",
        PeakAccumulator,
        lambda peak: peak.found.whirl,
        Row("peak {W}", lambda m, display: peak_text(m.peak_whirl, m.peak_time, display)),
        better=Better.SMALLER,
    )
    peak_time = Metric[float](
        "peak_time",
        "s",
        "time of the largest whirl",
        "t of max W(t)",
        PeakAccumulator,
        lambda peak: peak.found.time,
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
        lambda band: band.found,
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
        lambda residual: residual.unbalance,
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
        lambda residual: residual.couple,
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
        lambda passage: passage.found,
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
        lambda accumulator: accumulator.found,
        Row(
            "balls circulate",
            lambda m, display: circulating_text(m.circulating, len(m.final_ball_angles), display),
            place=Place.COURSE,
            note=CIRCULATE,
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
        lambda accumulator: accumulator.found,
        Row(
            "balls overlap",
            lambda m, _: overlaps_text(m.overlaps),
            place=Place.COURSE,
            caution=f"balls overlap: {WHAT_CHANGES}",
        ),
        plain=lambda bunches: None if bunches is None else [bunch._asdict() for bunch in bunches],
        kind=MetricKind.STRUCTURE,
    )
