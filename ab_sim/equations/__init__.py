"""Every formula of the model, once: plain Python on numbers, without a word about computers.

A number is a float, or an expression of ``ab_sim.tracing``: run on floats a formula computes, run
on expressions it leaves behind what it is made of, which is emitted as machine code, differentiated
or printed. What each ball has is one object, too: an expression that stands for a number per ball,
or an array with one for each. Symbols as in docs/equations.md.

    sums          sums over a scene's effects, and over balls
    race          a ball on the race: where it is, what acts along it
    spindle       how the spindle moves: prescribed, or driven by a motor
    planar        a deck that moves in the plane of the disc
    in_space      a deck that moves and tilts in space, on mounts
    arrowhead     the equations of motion solved: balls eliminated, accelerations found
    energy        power of the motor, and what is dissipated
"""
