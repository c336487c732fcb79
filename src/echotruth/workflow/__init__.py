"""What the Snakemake workflow runs with: jobs and their cost, compiled functions, execution and progress."""
