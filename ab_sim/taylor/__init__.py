"""Taylor's method, in steps of its own, the scene's steps being samples in them.

A step is a polynomial of some order in time, whose coefficients follow from each other: Moore,
Interval Analysis (1966), ch. 11; Jorba and Zou (2005), Exp. Math. 14, 99-117. They are found from
the same expressions of the equations as everything else (``tracing.power_series``). How long a step
is follows from its last two. Order and tolerance are fixed; several runs side by side have steps of
their own. Scenes without events only: a series knows one branch of a law.

    series            from the equations to coefficients of the states: expressions
    step_length       how long a step may be, in LLVM's language
    clock             when steps begin, and samples are due: lines of numbers, and how they change
    emission          all of it as machine code
    run               what steps are taken with, and the next samples: in the subset
    drive             one run along a speed profile: as ``stepping.fixed_step.advance``
    side_by_side      eight runs: as ``stepping.side_by_side``
    assemble          from a system and its code to what steps are taken with

Emitted functions
-----------------
Of one run, or of lanes. All arguments are pointers to doubles: constants ``c``, branches ``b``, the
clock ``t`` of ``clock``, then

    coefficients(c, b, t, y, series)
        of the state y at BEGIN; and END
    move(c, b, t, series, reached, y, turns)
        y at TO, or, where ANEW says so, the state ``reached`` there; whole turns are taken out of
        it, and counted; BEGIN is TO then
    mark(c, b, t, said)
        which runs have a sample in the step at hand: LOCAL is that of these, NEXT the one behind
    sample(c, b, t, series, turns, bounds, reached, said, row)
        state and row at LOCAL; whether the state is within ``bounds``
    record(c, b, t, row, samples, nowhere, channel), record_dense(the same)
        of lanes: the rows of runs that have a sample due into ``samples``, a number, ``channel``,
        between the channels of one; dense: side by side. ``nowhere`` has room for one sample
"""
