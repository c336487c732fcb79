"""What the page says of the leaderboard."""

import pandas as pd

from echotruth.report import board


def standings(hearts):
    return pd.DataFrame(
        {
            **{"size_px": [64], "view": ["all"], "tracker": ["one"], "hearts": [hearts], "failures": [0]},
            **{"rank": [1.0], "nrmse_all_percent": [12.0]},
        }
    )


def test_it_says_what_the_bootstrap_draws():
    assert "over the 3 hearts." in board.of(standings(3), 64, 3)["interval"]
    assert "over the 3 hearts of the 7 cases." in board.of(standings(3), 64, 7)["interval"]
    assert "no intervals" in board.of(standings(1), 64, 2)["interval"]
