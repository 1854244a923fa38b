"""Identification of scene parameters from recordings of a drive, with intervals.

files, tables, mapping selection of recordings, their tables, meaning of their columns inputs,
checks conversion of recordings for the fit, refusal of unusable ones measured one recording
speed_profile profile of the recorded spindle, which runs follow runs, forward runs under the
conditions of a recording, and their derivatives colour whitening filter for noise after a sensor's
low-pass parameters, problem free parameters, and residuals over all recordings stages staged least
squares: without balls, start angles, everything knowledge identifiable and unidentifiable
directions intervals, residuals confidence intervals, and tests of the residuals missing,
holding_out effects that the scene lacks; recordings that were not fitted proposals choice of the
next recording run, result the whole procedure, and its result
"""
