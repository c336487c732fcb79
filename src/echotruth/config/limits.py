"""Largest sweeps: how many hearts, views and trackers a configuration may have, and how large its table may be."""

MAX_CASES = 100_000
"""Largest number of cases of a repository, also of those that conditions leave out."""
MAX_TABLE_BYTES = 2 * 2**20
"""Size of the largest table of hearts: 10 000 rows of 200 characters."""
MAX_TABLE_COLUMNS = 256
"""Largest number of columns of a table; each may become an array of the repository."""
MAX_DRAWN_KEYS = 64
"""Largest number of keys that are drawn."""
MAX_CONDITIONS = 100
"""Largest number of conditions."""
MAX_CONDITION = 1000
"""Longest condition, characters."""
MAX_VIEWS = 64
"""Largest number of views of a heart."""
MAX_TRACKERS = 64
"""Largest number of trackers."""
