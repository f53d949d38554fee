"""Long runs: counted goals, random faults, kills and mutations.

Each is a command of its own, ``python -m bench.stress.NAME``.
"""
