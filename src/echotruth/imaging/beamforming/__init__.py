"""From the full matrix to focused lines, and from row-column echoes to volumes: transmits, focusing, and scan lines."""
