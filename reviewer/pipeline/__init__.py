"""The paper's pipeline: align, detect, label, search, integrate; planned and resumed, anywhere."""
