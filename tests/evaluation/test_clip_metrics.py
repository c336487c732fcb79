"""Labels by which clips are sorted, and hearts told apart."""

import pytest
from finished_repository import configured, finish

import echotruth as et
from benchmarks.suite.comparison import by_heart
from echotruth.cases import expand
from echotruth.cases.labels import heart_of
from echotruth.config import Cases

pytestmark = pytest.mark.slow

TABLE = """case,seed,motion.affine.position,label.heart,label.split,label.group
a,1,,first,develop,healthy
b,2,,first,develop,
k,3,,,develop,7
d,4,,second,test,7
e,5,0.4,,test,7
f,6,0.4,,test,7
"""


@pytest.fixture(scope="module")
def clips(tmp_path_factory):
    config = configured(name="sorted", views=("mid",), cases=Cases(table=TABLE))
    return et.Repository(finish(tmp_path_factory.mktemp("sorted") / "sorted", config)).metrics().clips


def test_clips_have_the_labels_of_their_case_and_nothing_where_it_has_none(clips):
    table = clips.set_index("case")
    assert list(table["split"]) == ["develop"] * 3 + ["test"] * 3
    assert list(table["group"]) == ["healthy", "", "7", "7", "7", "7"]
    assert set(table["acoustics"]) == set(table["variation"]) == {""} and set(table["diagnosis"]) == {"healthy"}


def test_without_a_label_cases_of_one_motion_are_one_heart(clips):
    # Case k moves as those with a label do, and f as e.
    hearts = clips.set_index("case")["heart"].to_dict()
    assert list(hearts.values()) == ["first", "first", "heart", "second", hearts["e"], hearts["e"]]
    assert by_heart(clips, "nrmse_all_percent").index.tolist() == ["first", "heart", "second", hearts["e"]]


def test_hearts_whose_labels_are_long_numbers_stay_apart():
    given = {"a": "20240101", "b": "20240102", "k": "1.5", "d": "3.0", "e": "0.1", "f": "1.23456789"}
    rows = "".join(f"{case},{number},{label}\n" for number, (case, label) in enumerate(given.items()))
    cases = expand(configured(views=("mid",), cases=Cases(table=f"case,seed,label.heart\n{rows}")))
    assert {case.id: heart_of(case) for case in cases} == given | {"d": "3"}
