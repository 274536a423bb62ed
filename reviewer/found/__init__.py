"""Lost and found: what the runs found, under names, as a list that people search."""
