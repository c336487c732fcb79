"""Scripts, one a stage: each reads, calls one function, and writes."""
