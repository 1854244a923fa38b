"""A drive as C99: its equations, a loop of fixed steps, and the same as an FMU (FMI 3.0).

suitable      which scenes it can be made of; errors that say what to do of others
parameters    the constants of a scene as fields of a struct, with units
equations     functions of a model's expressions as C
declarations  what of a scene stands in header and source beside these
sources       header and source, example and check, from templates
fmu           model description, and the archive
"""
