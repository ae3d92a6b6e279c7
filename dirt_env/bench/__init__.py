"""Measurements that the documents quote, each made by a command."""
