"""The repository: its arrays, their store on disk, and the ledger of finished jobs."""
