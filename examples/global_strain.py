"""Read a repository: mean longitudinal strain of the wall and ejection fraction of every heart in it.

python examples/global_strain.py            # of the hearts that come with the package
python examples/global_strain.py out/demo
"""

import argparse

import echotruth as et

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("repository", nargs="?", default="sample", help="its folder")
hearts = et.learning.cases(parser.parse_args().repository)
table = hearts[["longitudinal_strain", "ejection_fraction"]]
print((100 * table).round(1).to_string())
