"""Vehicle, track, contact, engines, sensors: everything that describes and makes a run."""
