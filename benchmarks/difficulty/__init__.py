"""How well a clip can be tracked at all: a perfect tracker of the plane, and the Cramer-Rao bound of its speckle."""
