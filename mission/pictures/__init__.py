"""Plans and flights as pictures."""
