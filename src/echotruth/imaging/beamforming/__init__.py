"""From the full matrix to focused lines: transmits, receive focusing, and scan lines."""
