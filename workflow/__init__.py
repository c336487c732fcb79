"""What the rules run, and where: scripts of the stages, and profiles of Snakemake."""
