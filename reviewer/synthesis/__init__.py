"""Synthetic training pairs: objects pasted on reference images (the paper's training set).

Reading order: settings -> bank (objects to paste), demo_bank -> paste, jitter -> pairs -> folder.
"""
