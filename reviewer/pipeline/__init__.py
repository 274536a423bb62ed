"""The paper's pipeline: align, detect, label, search, integrate; planned, resumed, on any engine."""
