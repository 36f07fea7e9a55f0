"""Random worlds: is everything that the gate passes sound, and is there a plan where a simple tour is feasible?"""
