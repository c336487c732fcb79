"""Finite elements: quadratic tetrahedra, location of points in them, quadrature, and sparse systems of equations."""
