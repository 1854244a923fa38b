"""Formulas of motion as plain functions, each written once.

Called with floats they compute; called with expressions of ``ab_sim.tracing`` they return
expressions, which are emitted as machine code, differentiated or printed. A quantity per ball is
one object: an expression that stands for a number per ball, or an array with one for each. Symbols
are those of docs/equations.md, which also names the places of set-valued laws, resting states and
speed laws.

    sums          sums over a scene's effects, and over balls
    effects       effects, one file each
    motion        arguments of effects: ball, deck and spindle in motion
    race          ball on the race: its position, and the forces along the race
    spindle       motion of the spindle: prescribed, or driven by a motor
    deck_model    interface of deck models
    planar        deck that moves in the plane of the disc
    in_space      deck that moves and tilts in space, on mounts
    mounts        springs and dampers between deck and ground
    orientation   quaternions and rotations
    neighbours    lengths along the race between balls that touch, and balls' start angles
    arrowhead     solution of the equations of motion: balls eliminated, accelerations computed
    energy        power of the motor, and dissipated power
"""
