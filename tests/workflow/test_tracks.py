"""Results of trackers are taken up as long as neither their own code nor what they are given changes."""

import pytest

from echotruth.repository import provenance
from echotruth.workflow import processes, tracks

METHODS = ("phase_correlation", "window_deformation", "affine_dic", "bspline_dic", "dis", "ilk")


@pytest.fixture
def codes(monkeypatch):
    """Function: code of every method, with one module of the package changed."""

    def changed(module=""):
        def source(name):
            found = original(name)
            return found._replace(digest="changed") if name == f"echotruth.tracking.{module}" else found

        monkeypatch.setattr(provenance, "_source", source)
        provenance.code_version.cache_clear()
        return {method: tracks.method_code(method) for method in METHODS}

    original = provenance._source
    yield changed
    provenance.code_version.cache_clear()


@pytest.mark.parametrize(
    ("module", "concerned"),
    [
        ("trackers.bspline_dic", {"bspline_dic"}),
        ("evidence", {"bspline_dic"}),
        ("subset", {"affine_dic", "bspline_dic"}),  # both sum B-splines along the columns
        ("trackers.window_deformation", {"window_deformation", "affine_dic"}),  # a grid of windows starts affine_dic
        ("trackers.ilk", {"ilk"}),
        ("quality", set(METHODS)),
        ("closure", set(METHODS)),
        ("trackers.dis", set(METHODS)),  # by its flow clips are judged to be open or closed
        ("tracker", set(METHODS)),
    ],
)
def test_change_of_a_module_concerns_the_methods_that_use_it(codes, module, concerned):
    before, after = codes(), codes(module)
    assert {method for method in METHODS if before[method] != after[method]} == concerned


def test_each_method_has_a_code_of_its_own(codes):
    assert len(set(codes().values())) == len(METHODS)


@pytest.mark.parametrize(
    ("stage", "module"),
    [
        ("mechanics", "mechanics.solver.equilibrium"),
        ("phantom", "imaging.medium.medium"),
        ("rf", "imaging.rf.full_matrix"),
        ("truth", "imaging.truth"),
        ("bmode", "imaging.bmode"),
        ("tracking", "tracking.trackers.bspline_dic"),
        ("tracking", "evaluation.displacement_error"),
        ("tracking", "evaluation.clip"),
        ("report", "report.bullseye"),
    ],
)
def test_code_of_a_stage_holds_the_modules_that_its_results_come_from(stage, module):
    names = provenance._dependencies((processes.script(stage),))
    assert f"echotruth.{module}" in names
