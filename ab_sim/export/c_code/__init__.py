"""Export of a drive as C99 (its equations and a loop of fixed steps) or as an FMU (FMI 3.0).

suitable      scenes that can be exported; errors with remedies for others
parameters    constants of a scene as fields of a struct, with units
equations     functions of a model's expressions as C
declarations  other declarations in header and source that depend on the scene
templates     filling of the templates in template_files
sources       header and source, example and check
model_description   XML files of an FMU
fmu           archive of an FMU
writing       writing of files: all of them or none
"""
