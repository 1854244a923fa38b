"""Taylor's method with steps of variable length; the scene's fixed steps are samples of them.

A step is a polynomial of fixed order in time, whose coefficients follow from a recurrence: Moore,
Interval Analysis (1966), ch. 11; Jorba and Zou (2005), Exp. Math. 14, 99-117. They are derived from
the same expressions of the equations as all other code (``tracing.derivatives``). The last two
coefficients determine the length of a step. Order and tolerance are fixed; each of several runs
side by side chooses its own steps. The method is for scenes without events only, because a series
describes one branch of a set-valued law.

    series            expressions of the states' coefficients, from the equations
    clock             times of steps and samples, and the expressions that update them
    emission          machine code of all functions below
    driver            steps of one run and of eight, for the loops in ``stepping.advance``
    assemble          build the runs from a system and its code

Emitted functions
-----------------
For one run, or for lanes. All arguments are pointers to doubles: constants ``c``, branches ``b``,
the clock ``t`` of ``clock``, then

    coefficients(c, b, t, y, series)
        compute the series of the state y at BEGIN, and END
    move(c, b, t, series, reached, y, turns)
        set y to the state at TO, or to ``reached`` where RESTART is set; remove and count whole
        turns; set BEGIN to TO
    mark(c, b, t, status)
        mark the runs with a sample in the current step; set LOCAL to its time and NEXT to that of
        the following one
    sample(c, b, t, series, turns, bounds, reached, status, row)
        compute state and row at LOCAL, and check that the state is within ``bounds``
    record(c, b, t, row, samples, nowhere, channel), record_dense(same arguments)
        for lanes: write the rows of runs with a sample due into ``samples``, where ``channel`` is
        the stride between channels; dense: stride 1. ``nowhere`` has room for one sample
"""
