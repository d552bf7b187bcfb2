"""What the images of a capture say of the conventions that its files state, before anything is made of them."""
