"""Merging copies what a configuration asks for, leaves its sources as they are, and a run makes the rest."""

import pytest
from finished_repository import configured, content, finish, plan_of, remake

from echotruth.cases import expand
from echotruth.workflow import merging
from echotruth.workflow.merging import merge

BOTH = configured(views=("mid",), cases={"table": "case,fibres.endo_deg\na,60\nb,70\n"})


def only(case):
    table = "\n".join(line for line in BOTH.cases.table.splitlines() if line[0] in ("c", case))
    return configured(views=("mid",), cases={"table": f"{table}\n"})


@pytest.fixture(scope="module")
def sources(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sources")
    return [finish(folder / case, only(case)) for case in "ab"]


def test_first_source_counts_and_what_is_there_is_kept(sources, tmp_path):
    plan = plan_of(tmp_path / "small", BOTH)
    assert merge(plan, [sources[0]]) == 2 and merge(plan, sources) == 2 and merge(plan, sources) == 0


def test_what_was_made_with_other_settings_is_made_anew(sources, tmp_path):
    other = BOTH.model_copy(update={"seed": 5})
    assert merge(plan_of(tmp_path / "small", other), sources) == 4
    done = remake(tmp_path / "small", other)
    assert (
        "rf a mid" in done
        and "bmode b mid" in done
        and not [job for job in done if "mechanics" in job or "truth" in job]
    )


def test_merge_that_was_killed_is_gone_on_with_and_is_one_that_was_made_at_once(sources, tmp_path, monkeypatch):
    plan, before = plan_of(tmp_path / "small", BOTH), content(sources[0])

    def fail(source, target):
        target.mkdir(parents=True)
        raise KeyboardInterrupt

    monkeypatch.setattr(merging.shutil, "copytree", fail)
    with pytest.raises(KeyboardInterrupt):
        merge(plan, sources)
    monkeypatch.undo()
    assert merge(plan, sources) == 4
    assert remake(tmp_path / "small", BOTH) == ["repository"]
    assert content(tmp_path / "small") == content(finish(tmp_path / "once/small", BOTH))
    assert content(sources[0]) == before


def test_heart_that_several_cases_share_is_copied_once(tmp_path):
    shared = configured(views=("mid",), seeds=(1, 2))
    source = finish(tmp_path / "source", shared)
    assert merge(plan_of(tmp_path / "small", shared), [source]) == 1 + 2
    assert len({case.heart for case in expand(shared)}) == 1
