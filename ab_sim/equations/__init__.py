"""The formulas of motion, once each: plain functions.

Called with floats they compute; called with expressions of ``ab_sim.tracing`` they return
expressions, which are emitted as machine code, differentiated or printed. A quantity that each ball
has is one object: an expression that stands for a number per ball, or an array with one for each.
Symbols as in docs/equations.md, which says where set-valued laws, resting states and speed laws
are.

    sums          sums over a scene's effects, and over balls
    effects       the effects, a file each
    motion        what an effect sees: ball, deck and spindle in motion
    race          a ball on the race: where it is, what acts along it
    spindle       how the spindle moves: prescribed, or driven by a motor
    deck_model    what a deck model consists of
    planar        a deck that moves in the plane of the disc
    in_space      a deck that moves and tilts in space, on mounts
    mounts        springs and dampers between deck and ground
    orientation   quaternions and turning
    neighbours    lengths along the race between balls that touch, and where balls start
    arrowhead     the equations of motion solved: balls eliminated, accelerations found
    energy        power of the motor, and what is dissipated
"""
