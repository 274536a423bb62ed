"""What people touch: one public port with the API, the workbench, and the Viser shell behind it."""
