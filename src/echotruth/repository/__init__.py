"""The repository: what arrays there are, where they lie, and the ledger of what was written."""
