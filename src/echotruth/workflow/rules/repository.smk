"""Create cases and arrays before the first job; verify files and write attributes after the last."""


# Not a rule: every heart would depend on it, and Snakemake does not check the inputs of a rule that it runs again
# (even if they are `ancient`), so that it would miss a changed tracker. Existing values stay.
onstart:
    command = [sys.executable, str(SCRIPTS / "cases.py"), str(FOLDER), "-"]
    subprocess.run(command, input=CONFIG.model_dump_json(), text=True, check=True)


# All records are named, so that one that a failed job lost is made again even if its dependants exist.
RECORDS = [
    *(record(stage, case) for stage in GATES for case in CASES),
    *(record(stage, case, view) for stage in VIEW_STAGES for case in CASES for view in CONFIG.views),
]


rule repository:
    input:
        RECORDS,
    output:
        FOLDER / "ledger/repository.json",
    params:
        config=CONFIG.model_dump_json(),
        code=code("cases", "repository"),
    log:
        FOLDER / "logs/repository.log",
    shell:
        "{RUN}/repository.py {FOLDER} &> {log}"
