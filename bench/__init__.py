"""The benchmark: ``python -m bench [PART ...]``, all by default; parts are listed in ``__main__``.

Speed is stated as a ratio against the same computation in C on the same machine, measured in turns.
"""
