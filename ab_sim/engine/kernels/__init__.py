"""Machine code of a scene's equations: traced once for each kind of scene, emitted, called.

model         equations of a kind of scene as expressions
constants     layout of a scene's numbers in memory
emission      functions of expressions: slope, tables for events, samples
runge_kutta   step of an explicit method
tangent       derivatives with respect to states and time
code          all functions of a kind of scene, compiled when first requested
"""
