"""The workflow of the package, for those who call Snakemake themselves in a checkout."""


include: "src/echotruth/workflow/Snakefile"
