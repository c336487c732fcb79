"""From a configuration to a beating left ventricle with known motion."""
