"""Scripted behaviours: no weights, no training. `make(config)` of each module gives a `dirt_env.policy.Policy`."""
