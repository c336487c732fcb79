"""Bounds on what keys amount to together, so that no configuration exhausts the memory or takes days for one heart.

They lie a hundred times and more above the default heart, and are checked before anything is made.
"""

MAX_CASES = 100_000
"""Largest number of cases of a repository, also of those that conditions leave out."""
MAX_TABLE_BYTES = 2 * 2**20
"""Size of the largest table of hearts: 10 000 rows of 200 characters."""
MAX_TABLE_COLUMNS = 256
"""Largest number of columns of a table; each may become an array of the repository."""
MAX_CELL = 4000
"""Longest cell of a table, as a note may be, characters."""
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
MAX_CLIP_PIXELS = 10**9
"""Largest number of pixels of a clip; the truth takes some 50 bytes a pixel."""
MAX_ECHO_SAMPLES = 2 * 10**9
"""Largest number of samples of one frame's RF, in all pairs of elements; 4 bytes each."""
MAX_LINE_SAMPLES = 2 * 10**9
"""Largest number of samples of a clip's lines; 8 bytes each."""
MAX_SCATTERERS = 5 * 10**7
"""Largest number of scatterers of a view; the default heart has 2 x 10^5."""
