"""The symbols of laws stand for real numbers."""

from __future__ import annotations

import sympy as sp

from asperity.contacts.symbols import ARGUMENT_ORDER, ContactSymbols


def test_every_symbol_is_real() -> None:
    """Square roots simplify only for real symbols; a plain symbol is the negative control."""
    parameter = ContactSymbols(("size",)).parameter("size")
    for symbol in (*ARGUMENT_ORDER, parameter):
        assert sp.sqrt(symbol**2) == sp.Abs(symbol)
    assert sp.sqrt(sp.Symbol("h") ** 2) != sp.Abs(sp.Symbol("h"))
