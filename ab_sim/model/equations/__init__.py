"""Formulas of motion as plain functions, each written once.

Called with floats they compute; called with expressions of ``ab_sim.tracing`` they return
expressions, which are emitted as machine code, differentiated or printed. A quantity per ball is
one object: an expression that stands for a number per ball, or an array with one for each. Symbols
are those of docs/equations.md, which also names the places of set-valued laws, resting states and
speed laws.

    sums          sums over a scene's effects, and over balls
    effects       effects that a scene may name
    motion        balls on the race, deck and spindle: their motion, and forces along the race
    deck_model    interface of deck models
    planar        deck that moves in the plane of the disc
    in_space      deck that moves and tilts in space, on mounts
    mounts        springs and dampers between deck and ground; quaternions and rotations
    neighbours    lengths along the race between balls that touch, and balls' start angles
    arrowhead     solution of the equations of motion: balls eliminated; powers, for energy
"""
