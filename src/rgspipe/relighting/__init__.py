"""What a frozen scene looks like in other lights: rigs, sweeps of a spot, pictures of them."""
