"""The operating system: all that the package asks of Linux, Windows or macOS.

Which system it is follows from what it has, and each function says what the system lacks; other
modules ask for neither.
"""
