"""Create cases and arrays before the first job; verify files and write attributes after the last."""


# Not a rule: every heart would depend on it, and Snakemake does not check the inputs of a rule that it runs again
# (even if they are `ancient`), so that it would miss a changed tracker. Existing values stay.
onstart:
    try:
        lease.hold(FOLDER)
    except OSError as error:
        raise WorkflowError(str(error))
    write_configuration(FOLDER, CONFIG)
    # Jobs in a queue read the configuration again, which may have changed by then.
    workflow.config_settings.configfiles = [write_sweep(FOLDER, CONFIG).absolute()]
    command = [sys.executable, str(SCRIPTS / "cases.py"), str(FOLDER), "-"]
    subprocess.run(command, input=CONFIG.model_dump_json(), text=True, check=True)


rule repository:
    input:
        # A function, because Snakemake keeps every path that a rule names twice.
        lambda wildcards: in_batch(
            requested_records(FOLDER, CASES, CONFIG.views), "repository", workflow.dag_settings.batch
        ),
    output:
        FOLDER / "ledger/repository.json",
    params:
        config=CONFIG.model_dump_json(),
        code=code("cases", "repository"),
    log:
        FOLDER / "logs/repository.log",
    group:
        "report"
    resources:
        runtime=lambda wildcards, attempt: attempt * demand.minutes("repository", CONFIG),
        mem_mb=lambda wildcards, attempt: attempt * demand.megabytes("repository", CONFIG),
    shell:
        "{RUN}/repository.py {FOLDER} &> {log}"
