"""Collocation on Gauss' nodes: steps of its own, the scene's steps being samples in them.

What carries the balls, the balls, and a motor's spindle are written as x'' + c x' + k x = f. f is a
polynomial through its values at N nodes, found by iteration; what it makes of the motion is exact
(``responses``), however stiff, and at any instant of the step. Of order 2 N at the end of a step
where the iterations are carried far enough: Hairer, Norsett, Wanner, Solving Ordinary Differential
Equations I, II.7; Hochbruck and Ostermann (2005), Appl. Numer. Math. 53, 323-339: exponential
collocation.

    nodes             nodes, and all that follows from them alone (Python, before a run)
    impulse           what one left-hand side makes of an impulse
    responses         a table of responses of one left-hand side
    tables            which tables a step takes
    table_lending     where a run has them from (Python)
    run               what collocation works with
    lengths           how long the next step is
    step              one step, solved
    event_fallback    steps in which a law may take another branch: another stepper's
    drive             along a speed profile: as ``stepping.fixed_step.advance``
    coordinates       of the two deck models: formulas
    formulas          one iteration: formulas
    step_formulas     a step's start, its error, states in it: formulas
    ball_order        an order of many balls' formulas (Python)
    emission          the first two as machine code, a lane for each node
    sampling          states in a step, and what is made of them, likewise
    assemble          from a system and its code to a ``run.CollocationMethod``

From ``nodes`` to ``drive``, but for what is said to be for Python, all is in the subset that
``ab_sim.compiling`` translates; it depends on no scene, and takes any number of balls and nodes.

Emitted functions
-----------------
What control calls by address. All arguments are pointers to doubles, then doubles. A *line* is N
doubles, one for each node; ``c`` are a scene's constants, ``b`` its branches, as in
``events.run.SceneFunctions``. R is the number of equations and of what else is integrated (the
motor's loop, the energy balance); ``f`` and ``old`` are R lines: of the deck's coordinates, each
ball, a motor's spindle, then the rest. ``tables`` and ``numbers`` are the first line and the
numbers of a set of tables, ``spindle`` and ``spindle_numbers`` those of the one table that a
motor's spindle takes (any without a motor). ``own`` is ``run.CollocationRun.linear``, ``weights``
``run.CollocationMethod.lines``.

    begin(c, b, own, y, f, time)
        at a state y and a local time [s]: f there, R numbers, and the spindle's speed [rad/s]
    start(c, b, own, numbers, spindle_numbers, tables, spindle, weights, carry, y, old, work, begin,
          length, moved)
        f carried on from the last step, and all that the iterations leave as it is, into ``work``;
        ``carry`` are the columns of a matrix, y is the state at the beginning, ``moved`` the angle
        that the rotor's axes have made in the last step [rad]
    iterate(c, b, own, tables, spindle, work, result), iterate_near(the same)
        one iteration; ``near``: angles have changed by less than ``formulas.SMALL`` since the last.
        ``result``, as in ``run.CHANGED``, gets its first four numbers
    judge(c, b, numbers, spindle_numbers, weights, work, result, begin, length)
        the last three numbers of ``result``: errors, and the angle that the axes make
    keep(c, b, work, f)
        copies f out of ``work``
    sample(c, b, own, tables, spindle, weights, bounds, y, f, states, begin, length)
        states at the N instants up to which the tables reach, in lines as of ``Buffers.states``;
        ``bounds`` are magnitudes that no sound run reaches
    rows(c, b, times, states, turns, samples, width, count)
        rows of the first ``count`` of such states, ``width`` numbers apart; ``times`` are their
        lines TIME and PROFILE_TIME, ``turns`` the whole turns of each ball and of the spindle
    evaluate(c, b, times, states, nodes)
        with events: of each state a line of what ``Scene.evaluate`` says: state, slope,
        accelerations, motor, table of the balls
    take_node(node, x, motor, table)
        copies the last three out of such a line

In plain Python an address may be any callable of these arguments: that is how tests count calls.
"""
