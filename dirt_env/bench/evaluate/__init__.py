"""Policies against each other on held-out layouts: `dirt-push evaluate`; docs/evaluation.md."""
