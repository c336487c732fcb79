"""Cases and arrays before the first job; verification, verdicts and attributes after the last."""


# Not a rule: every heart would hang on it, and Snakemake looks no further below a rule that is to run again
# (not even where its output is `ancient`), so that a changed tracker would be overlooked. What is there already stays.
onstart:
    command = [sys.executable, str(SCRIPTS / "cases.py"), str(FOLDER), "-"]
    subprocess.run(command, input=CONFIG.model_dump_json(), text=True, check=True)


# Every record by name: one that a failed job lost is asked for even where what was made from it is there.
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
