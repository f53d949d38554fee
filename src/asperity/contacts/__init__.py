"""Where a surface is felt: one room per contact, from its symbols to its kernels."""

from __future__ import annotations

from asperity.contacts.contact import Contact
from asperity.contacts.nearest.contact import NEAREST
from asperity.contacts.nominal import NOMINAL
from asperity.contacts.split.contact import SPLIT
from asperity.contacts.vertical import VERTICAL

__all__ = ["CONTACTS", "Contact"]

CONTACTS: dict[str, Contact] = {
    contact.name: contact for contact in (NOMINAL, VERTICAL, NEAREST, SPLIT)
}
"""The contacts that come with the package, by name."""
