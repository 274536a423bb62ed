"""Reports: figures, tables and pages for people to read. The one wing that draws plots."""
