"""The door: the one public port, who may come in, and what goes on to Viser."""
