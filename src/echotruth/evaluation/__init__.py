"""Comparison of tracked motion with the truth: displacement, strain, statistics and the leaderboard.

One clip:

    clip                the clip as a tracker receives it
    points              true motion and strain of the points that trackers follow
    scoring             score of a tracker, made by the next four, and the metrics of the leaderboard
    displacement_error  NRMSE, drift, coverage and other errors of displacement
    agreement           error of strain, by its parts: plane, operator and tracker
    contours            GLS and GCS: strain of the length of the contours of the wall
    courses             strain, rotation and their rates over the cycle, peaks
    segment_strain      strain of AHA segments
    reliability         whether the quality that a tracker gives is the probability of being right
    point_tracks        metrics of point tracks and of optical flow, as other benchmarks have them

What these are made with: strain (from displacement), local_fit (gradients), polar, statistics.

What is read from a repository:

    curves              curves over the cycle, tracked beside true
    summary             table of strain: at end-systole, at its peak, time to peak, rate
    tracks              points of the grid, tracked and true
    clip_metrics        table of the metrics of all clips
    leaderboard         ranks of the trackers over hearts (paired_ratios), with intervals (resampling)

A tracker from outside, `echotruth evaluate`: tracker_options, availability, parallel.
"""
