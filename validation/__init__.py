"""What the heart is checked against: exact solutions, published problems, an independent solver, and conservation laws.

One module a check. Each has three functions: `measure` solves and returns numbers, `report` makes a
table of them with what was expected and where that comes from, and `draw` a figure. `echotruth validate`
runs them all and writes docs/validation.md.
"""
