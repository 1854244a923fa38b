"""Machine code of a scene's equations: traced once for each kind of scene, emitted, called.

model         equations of a kind of scene as expressions
constants     layout of a scene's numbers in memory
emission      functions of expressions: slope, tables for events, samples
runge_kutta   step of an explicit method
code          all functions of a kind of scene, compiled when first requested; derivatives

Memory
------
All numbers are doubles behind pointers. Arguments have the order ``c``, ``b``, other pointers,
numbers. In lanes (eight runs or eight directions) a pointer ``t`` to the times follows ``b``, and
each number takes as many adjacent doubles as there are lanes; a pointer declared *uniform* has one
number for all lanes.

c       constants: fields of deck and effects in order; columns of the balls, n each; the position
        on the speed profile, which the driver writes; values that ``prepare`` derives
b       branches of set-valued laws, written by ``engine.events.balls.put_branches``: n signs of
        sliding friction (0 if a ball sticks or is unloaded); the mobility of the balls (n numbers
        1/mu, or with contact a symmetric n x n matrix); the motor's limit
y       state, in the order of ``model.dynamics.system``: deck; all angles; all rates; three
        numbers of a motor; two of the energy balance. Slope ``k`` and ``trial`` alike
table   inputs of events: one row per column of ``engine.events.run``, one number per ball
x       accelerations, the spindle's last
block   equations of the body that carries the balls, forces last

Functions
---------
prepare(c)                                    derived constants
slope(c, b, y, k, time)                       rates of change
step(c, b, y, k, trial, begin, length)        step of a Runge-Kutta method or of ``imex8``; k is the
                                              slope at its beginning
finish(c, b, y, k, row, time, profile_time)   slope, and the row of a sample
evaluate(c, b, y, k, x, motor, table, time)   slope, and the inputs of events
arrow(c, b, y, block, time)                   equations of motion, for impacts
apply_impulse(c, b, y, jumps, v)              impact: change the velocities
restitution(c, b, out, approach)              impact: coefficients of restitution
tangent(c, b, t, y, d, out)                   exact derivative of the slope along directions

Lanes also have the functions of ``engine.stepping.emitted``: one accepts or rejects a step, the
other finds lanes that may have an event. An address is valid as long as its ``Code`` object lives;
``code_of`` keeps the 16 kinds used last, at 0.7 MB each.
"""
