"""Damage to files, at random, for the fuzz run."""

from __future__ import annotations

import random

_WORDS = (b"0", b"-1", b"65535", b"4294967296", b"1e308", b"nan", b"inf", b"\0", b"<", b",", b" ")


def mutate(content: bytes, rng: random.Random) -> bytes:
    """Damage a file in one to four places: bits, bytes, numbers, cuts, copies, other text."""
    data = bytearray(content)
    for _ in range(rng.choice((1, 1, 2, 4))):
        if not data:
            break
        # Half of the damage goes where headers are.
        at = rng.randrange(min(len(data), 512) if rng.random() < 0.5 else len(data))
        _damage_once(data, at, rng)
    return bytes(data)


def _damage_once(data: bytearray, at: int, rng: random.Random) -> None:
    length = rng.choice((1, 2, 4, 16, 64))
    kind = rng.randrange(8)
    if kind == 0:
        data[at] ^= 1 << rng.randrange(8)
    elif kind == 1:
        data[at] = rng.randrange(256)
    elif kind == 2:
        data[at : at + length] = rng.randbytes(length)
    elif kind == 3:
        del data[at : at + length]
    elif kind == 4:
        data[at:at] = data[at : at + length] * rng.choice((1, 3))
    elif kind == 5:
        data[at : at + rng.choice((0, 1, 4))] = rng.choice(_WORDS)
    elif kind == 6:
        data[at : at + 4] = rng.choice((b"\xff\xff\xff\xff", b"\0\0\0\0", b"\xff\xff\xff\x7f"))
    else:
        del data[at + rng.randrange(len(data)) :]
