"""Read a repository: mean longitudinal strain of the wall and ejection fraction of every heart in it.

python examples/global_strain.py            # of the hearts that come with the package
python examples/global_strain.py out/demo
"""

import sys

import echotruth as et

hearts = et.learning.cases(sys.argv[1] if len(sys.argv) > 1 else "sample")
table = hearts[["longitudinal_strain", "ejection_fraction"]]
print((100 * table).round(1).to_string())
