"""Studies: one stage, and for each kind of study what its rows are and what it asks for."""
