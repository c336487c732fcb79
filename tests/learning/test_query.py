"""What is said of a query that cannot be evaluated."""

import pandas as pd
import pytest

from echotruth.learning.table import _selected

FOUND = pd.DataFrame({"status": ["complete", "failed"], "ejection_fraction": [0.6, 0.4], "fibres.endo_deg": [60, 66]})
PARAMETERS = FOUND[["fibres.endo_deg"]].assign(**{"loop.edv_uL": 50.0})


def test_query_over_columns_and_over_keys_that_are_the_same_in_all_cases():
    assert list(_selected(FOUND, PARAMETERS, "status == 'complete' and `loop.edv_uL` > 40")) == [0]
    assert list(_selected(FOUND, PARAMETERS, "`fibres.endo_deg` > 60")) == [1]


@pytest.mark.parametrize(
    ("query", "sentence"),
    [
        ("ejection_fractio < 0.5", "ejection_fractio is not a column: did you mean ejection_fraction?"),
        ("fibres.endo_deg > 60", "fibres.endo_deg has a dot: write it in backticks, as `fibres.endo_deg`."),
        ("zzz > 60", "zzz is not a column: echotruth.learning.cases lists them."),
        ("status = 'complete'", "has a single =: compare by ==."),
        ("status ==", "cannot be evaluated (invalid syntax): write it as status == 'complete'"),
    ],
)
def test_query_that_cannot_be_evaluated_is_told_with_what_would_be_right(query, sentence):
    with pytest.raises(ValueError) as error:
        _selected(FOUND, PARAMETERS, query)
    assert str(error.value).startswith(f"query = {query!r}: {sentence}") and "\n" not in str(error.value)
