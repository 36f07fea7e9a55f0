"""The link to a vehicle: mavsdk as the client, with what it leaves out beside it."""
