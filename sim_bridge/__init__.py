"""Vehicles: frames, MAVLink, links to a vehicle, and a kinematic vehicle that speaks MAVLink.

Knows nothing of planning. Inside this package frames are named; every axis swap and sign flip is in
`sim_bridge.frames`.
"""
