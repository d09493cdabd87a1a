"""Writers of tables for other programs, one format a file: `write(content, path)`."""
