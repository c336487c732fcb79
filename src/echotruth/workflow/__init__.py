"""What the Snakemake workflow runs with; the rules themselves are in `rules/`, their scripts in `workflow/scripts/`.

What the Snakefile and its rules ask:

    plan               inputs, parameters, time and memory of each rule, from the configuration
    resources          time and memory that a job asks for, from its cost
    blocks             parts of a large sweep, each planned by a Snakemake of its own
    processes          beginning of the shell commands of all rules, cache of compiled functions
    instructions       the same instructions of the processor for all jobs
    lease              one run at a time writes a repository, and its processes end with it

What a script does:

    job                one job: what it reads, the arrays that it writes, and the record that commits them
    failure            the error of a case that has no solution
    sharing            cases that share one heart: its files are taken over
    tracks             what trackers find in a clip, taken up from an earlier run if it is the same

What `echotruth run`, `status` and other commands do:

    running            the Snakemakes of a run: one for every block, then one for repository and report
    snakemake_process  a Snakemake as a process, with its log and the progress line, and its end
    progress           share done and time left, from the logs
    jobs               which jobs each rule has, and which have ended
    cost               CPU time that a job is expected to take
    imaged_tissue      how much tissue a view images, for the cost
    estimate           what a run will take, before it
    concerns           what speaks against a run
    summary            what a run has made
    status             how a repository is getting on
    integrity          faults of a repository, and their healing
    merging            several repositories in one
    uploading          upload beside a run, and afterwards
"""
