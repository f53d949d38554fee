"""Contacts between probe and surface, each from its symbols to its compiled kernels."""

from __future__ import annotations

from asperity.contacts.contact import Contact
from asperity.contacts.contact_kinds import NEAREST, NOMINAL, SPLIT, VERTICAL

__all__ = ["CONTACTS", "Contact"]

CONTACTS: dict[str, Contact] = {
    contact.name: contact for contact in (NOMINAL, VERTICAL, NEAREST, SPLIT)
}
"""The contacts that come with the package, by name."""
