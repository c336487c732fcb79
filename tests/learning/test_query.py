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
    "query", ["fibres.endo_deg > 60", "zzz > 60", "status = 'complete'", "status ==", "status > 3", ""]
)
def test_query_that_cannot_be_evaluated_is_told_with_what_would_be_right(query):
    with pytest.raises(ValueError) as error:
        _selected(FOUND, PARAMETERS, query)
    said = str(error.value)
    assert said.startswith(f"query = {query!r}: cannot be evaluated (") and "`fibres.endo_deg` > 60" in said
    assert "\n" not in said
