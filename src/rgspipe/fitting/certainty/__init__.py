"""How sure a fit is: a fitted rig in; covariances, doubts, the loss around it and views that would help out."""
