"""Machine code of a scene's equations: traced once for what it is made of, emitted, called.

model         the equations of a kind of scene as expressions
constants     where the numbers of a scene are in memory
emission      functions of expressions: slope, tables for events, samples
runge_kutta   a step of an explicit method
tangent       derivatives by states and time
code          all functions of a kind of scene, made when first asked for
"""
