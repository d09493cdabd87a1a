"""Wheel and rail profiles: files, standard shapes, wear, contact search, equivalent conicity."""
