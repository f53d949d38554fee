"""Tests of the page, with one lab, which ends with the last of them."""
