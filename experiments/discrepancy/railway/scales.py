"""Scales of the latent forces and readings that healthy vehicles have, relative to what acts at their place."""

SCALES: dict[str, float] = {
    "force contact of wheelset y": 0.0436,
    "force contact of wheelset yaw": 0.0134,
    "force contact of wheelset z": 0.005,
    "force primary roll": 0.0395,
    "force primary y": 0.019,
    "force primary yaw": 0.0064,
    "force primary z": 0.034,
    "force secondary roll": 0.0067,
    "force secondary y": 0.0263,
    "force secondary yaw": 0.0199,
    "force secondary z": 0.0087,
    "reading axlebox.acceleration_y": 0.0048,
    "reading axlebox.acceleration_z": 0.0056,
    "reading body.acceleration_y": 0.0069,
    "reading body.acceleration_z": 0.0207,
    "reading body.rate_roll": 0.02,
    "reading bogie.acceleration_y": 0.0045,
    "reading bogie.acceleration_z": 0.0086,
    "reading bogie.rate_pitch": 0.0035,
    "reading bogie.rate_roll": 0.0045,
    "reading bogie.rate_yaw": 0.031,
    "reading primary.displacement": 0.0034,
    "reading wheelset.acceleration_y": 0.007,
    "reading wheelset.rate_roll": 0.002,
    "reading wheelset.rate_yaw": 0.0294,
}
"""By the kind of a level. Root mean square of two halves: records of the project's own simulators, and a healthy record
of a whole vehicle by a simulator that shares no code with them. Other kinds have the scale from before any learning.
"""
