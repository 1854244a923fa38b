"""From recordings of a drive to the numbers of its scene, each with an interval.

files, tables, mapping   which recordings there are, as tables, and what their columns are
inputs, checks           recordings as the fit takes them, those that cannot be used refused
measured                 one of them
speed_profile            the profile of the recorded spindle, which runs follow
runs, forward            runs under a recording's circumstances, and their derivatives
colour                   whitens what a sensor's low-pass has coloured
parameters, problem      what varies, and the residuals over all recordings
stages                   makes them small: without balls, start angles, everything
knowledge                what the recordings can tell at all
intervals, residuals     how far to believe the result
missing, holding_out     effects that the scene lacks; recordings that were not fitted
proposals                which recording to make next
run, result              all of that in order, and what comes out
"""
