"""A drive as C99: its equations, a loop of fixed steps, and the same as an FMU (FMI 3.0).

suitable      which scenes it can be made of; errors that say what to do of others
parameters    the constants of a scene as fields of a struct, with units
equations     functions of a model's expressions as C
declarations  what of a scene stands in header and source beside these
templates     files from templates, which are in template_files
sources       header and source, example and check
model_description   what an FMU's XML files say
fmu           the archive
writing       files written: all of them or none
"""
