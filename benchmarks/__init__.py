"""What the parts of echotruth take and how good they are, beside others; each script runs alone (README.md)."""
