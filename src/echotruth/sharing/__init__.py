"""What is made of a repository for others: files of other programs, documents, and releases, which are fetched."""
