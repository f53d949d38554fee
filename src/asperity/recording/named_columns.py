"""A table of rows whose parts go by the names of their columns."""

from __future__ import annotations

from dataclasses import dataclass

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError, suggest_names
from asperity.recording.row_encoding import Columns


class NamedColumns:
    """What has rows of a loop, and their parts by name.

    Attributes:
        columns: names and units.
        table: the rows, shape (k, columns).
    """

    columns: Columns
    table: FloatArray

    def has_columns(self, *names: str) -> bool:
        """Return whether there are columns of all these names."""
        return {*names} <= {name for name, _unit in self.columns}

    def select(self, *names: str) -> FloatArray:
        """Return columns by name, shape (k, names).

        Raises:
            ParameterError: for a name that there is not; the nearest are offered.
        """
        known = [name for name, _unit in self.columns]
        for name in names:
            if name not in known:
                hint = suggest_names(name, known)
                raise ParameterError("column", f"is unknown: {name!r}; {hint}")
        return self.table[:, [known.index(name) for name in names]]

    @property
    def time(self) -> FloatArray:
        """Of the samples [s], shape (k,)."""
        return self.table[:, 0]

    @property
    def position(self) -> FloatArray:
        """True position of the handle at the samples [m], shape (k, 3)."""
        return self.select("x", "y", "z")

    @property
    def velocity(self) -> FloatArray:
        """True velocity of the handle at the samples [m/s], shape (k, 3)."""
        return self.select("vx", "vy", "vz")

    @property
    def commanded(self) -> FloatArray:
        """Force that the law asked for at the sample, rounded and limited [N], shape (k, 3)."""
        return self._axes("commanded")

    @property
    def applied(self) -> FloatArray:
        """Force that is held from the sample on, after the delay [N], shape (k, 3)."""
        return self._axes("applied")

    @property
    def anchor(self) -> FloatArray:
        """Of the hand at the samples [m], shape (k, 3)."""
        return self._axes("anchor")

    @property
    def energies(self) -> dict[str, FloatArray]:
        """Sums of the ledger up to the samples [J].

        ``supplied`` and ``same_sample`` have shape (k, 3), one column per axis; ``lost``,
        ``hand``, ``friction``, ``sampling`` and ``stored`` have shape (k,).
        """
        axes = {"supplied": "supplied", "same_sample": "same sample"}
        single = ("lost", "hand", "friction", "sampling", "stored")
        return {name: self._axes(head) for name, head in axes.items()} | {
            name: self.select(name)[:, 0] for name in single
        }

    def _axes(self, head: str) -> FloatArray:
        return self.select(*(f"{head} {axis}" for axis in "xyz"))


@dataclass(frozen=True, eq=False)
class TraceTable(NamedColumns):
    """Rows of a recording: see :class:`NamedColumns`."""

    columns: Columns
    table: FloatArray

    def __repr__(self) -> str:
        return f"<Traced {len(self.table)} rows of {len(self.columns)} columns>"
