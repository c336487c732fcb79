"""The equations of the beating wall and their solution: element, cavity, support, Newton's method, and the cycle."""
