"""The repository: its arrays and groups on disk, and what reads, publishes and checks them."""
