"""Export of a drive as C99 (its equations and a loop of fixed steps) or as an FMU (FMI 3.0).

declarations  constants of a scene as fields of a struct, and other declarations
equations     functions of a model's expressions as C
templates     filling of the templates in template_files
sources       check of a scene; header and source, example and check; writing of them
fmu           XML files, archive and binary of an FMU
"""
