"""What the Snakemake workflow runs with; the rules themselves are in `rules/`, their scripts in `workflow/scripts/`.

What the Snakefile and its rules ask:

    plan          hearts, cases, time and memory of each rule, and what of them is made already
    cost          CPU time and memory that a job is expected to take
    lock          one run at a time writes a repository
    processes     beginning of the shell commands of all rules, cache of compiled functions
    instructions  the same instructions of the processor for all jobs

What a script does:

    job           one job: what it reads, and the groups that it writes
    failure       the error of a case that has no solution

What `echotruth run`, `status` and other commands do:

    run           Snakemake as a process, with its log and the progress line
    progress      share done and time left, from the log
    concerns      what speaks against a run
    status        how a repository is getting on
    merging       hearts and clips of other repositories, copied
    added_tracker a tracker added to a repository, and run on its clips
"""
