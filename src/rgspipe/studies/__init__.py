"""Studies: what became of cases × methods × numbers of views, as one table, one figure and one section of a page."""
