"""Verification of the solver: exact solutions, published problems, an independent solver, and conservation laws.

Each check is a module with three functions: `measure` solves and returns results, `report` tabulates them with the
expected values and their sources, and `draw` plots them. `python -m validation` runs all checks and writes
docs/validation.md.
"""
