"""Measured data in: CSV, Parquet, MDF4 and TDMS files become recordings, track-recording cars' files become tracks.

`importing.import_file` reads a file by a YAML map (docs/field_data.md). Nothing is guessed silently: whatever the map
leaves open is decided by a stated rule, printed, and stored with the result.
"""
