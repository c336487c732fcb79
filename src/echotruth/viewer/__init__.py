"""Viewer of a repository in the browser: what is shown (:mod:`clip`, :mod:`tint`, :mod:`paths`, :mod:`curves`), and
the page that shows it (:mod:`page`, :mod:`server`, :mod:`access`), which is built on Bokeh.
"""
