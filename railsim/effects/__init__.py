"""One physical effect a file: what a real vehicle, track or sensor does that the nominal scenario does not."""
