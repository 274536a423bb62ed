"""What this machine can do, and whether what lies on it is whole."""
