"""A texture whose law H is rendered as a baked potential field."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import ModuleType
from typing import Any, ClassVar

import numpy as np

from asperity.contacts.contact import Contact
from asperity.core.checks import FloatArray
from asperity.core.display import Tabular
from asperity.core.errors import ParameterError
from asperity.core.files import content_digest, to_plain_data
from asperity.measured.lengths import format_length
from asperity.textures.fields.field_bricks import align_bricks
from asperity.textures.fields.field_grid import FieldGrid
from asperity.textures.fields.field_record import BRICK_VALUES, ZERO, FieldArguments
from asperity.textures.texture import CertifiedNumber, Texture


@dataclass(frozen=True)
class FieldAccuracy:
    """Difference of a baked field from exact law H, forces over the stiffness.

    Attributes:
        bound: greatest difference [m] of a spline through exact depths, proved for all z above
            those where nodes are farther apart along z. The depths of a map are not proved, but
            those at probes are compared with them.
        potential_bound: that of the potentials [m²], likewise.
        rms: RMS difference of the forces [m], measured at random probes of the depths.
        largest: the greatest one measured [m].
        depths: depths below the highest point of which the probes are [m]; of a body, below its
            surface. At the least of them the mean force is about 0.1 N at 3000 N/m.
        shares: RMS difference over the RMS of the texture's force at each of them: the exact force
            about its mean there.
        presses: mean force at each of these depths [m]; of bodies, the mean of its norms.
        onset: greatest distance [m] from the surface at which contact was found to begin.
        onset_places: number of random places where it was measured.
        is_limited: whether the goal was missed, because no finer field has the size allowed.
    """

    bound: float
    potential_bound: float
    rms: float = 0.0
    largest: float = 0.0
    depths: tuple[float, ...] = ()
    shares: tuple[float, ...] = ()
    presses: tuple[float, ...] = ()
    onset: float = 0.0
    onset_places: int = 0
    is_limited: bool = False

    @property
    def share(self) -> float:
        """RMS difference over the RMS of the texture's force, at the depth where it is worst."""
        return max(self.shares, default=0.0)

    @property
    def worst_depth(self) -> float:
        """Depth [m] of that share."""
        return max(zip(self.shares, self.depths, strict=True), default=(0.0, 0.0))[1]


@dataclass(frozen=True)
class ThinRegion:
    """A part of a body that is thinner than twice the depth of its field.

    Attributes:
        at: where it is thinnest, on the medial axis [m].
        half_thickness: half of the thickness there [m]: pressed deeper, the probe is pulled to the
            other side.
        columns: number of columns of nodes that it spans.
    """

    at: tuple[float, float, float]
    half_thickness: float
    columns: int


def _of_source(name: str) -> property:
    """Return a property: an attribute or a method of the texture that was baked."""
    return property(lambda self: getattr(self.source, name), doc="See :class:`Texture`.")


class PotentialField(Texture, Tabular):
    """A potential field baked from law H of a texture, which is rendered without a search.

    T = S²/2 where S(p) = Σ c_n Π β((p - p_n)_i/h_i) is positive, β the quadratic B-spline, c_n
    the exact depth at nodes p_n, or where smoothed its mean over neighbouring nodes: √(2U) of the
    potential U of law H inside and the negative distance of the surface outside. The force is
    -k ∇T. So the force that is rendered is conservative and continuous, and its gain is certified
    from the coefficients. Where the surface is smooth, S is, too, and contact begins at the
    surface.

    Below the floor, the least height minus ``max_depth``, the variation of the force with depth
    fades, and farther below the field continues with the curvature of the flat wall; the certified
    gain covers both.

    Heights, slopes and the domain are those of the texture that was baked.

    Attributes:
        source: the texture that was baked.
        grid: the nodes.
        max_depth: depth below the least height down to which the numbers hold [m].
        continuity: c of law H.
        passes: number of smoothing passes, each around the cells whose gain is above the goal.
        gain: certified sup ‖Hess T‖, the characteristic number q.
        one_sided: certified sup λ_max(Hess T), the one-sided number q⁺.
        accuracy: difference from exact law H.
        claimed_gain: upper bound of q that the file states from which the field was loaded, whose
            ``accuracy`` is a claim of that file; ``None`` for a field that was baked here. All
            other numbers are computed from the coefficients.
        thin_regions: where a body can be pressed less deep than ``max_depth``, the thinnest first.
        thin_map: half of the thickness there [m] at the nodes of ``source``, NaN elsewhere;
            ``None`` without thin parts.

    Reference:
        docs/theory/split.md.
    """

    kind: ClassVar[str] = "field"
    finds_contacts: ClassVar[bool] = True
    claimed_gain: float | None = None

    def __init__(
        self,
        source: Texture,
        grid: FieldGrid,
        arguments: FieldArguments,
        *,
        max_depth: float,
        continuity: float,
        passes: int,
        gain: CertifiedNumber,
        one_sided: CertifiedNumber,
        accuracy: FieldAccuracy,
        thin_regions: tuple[ThinRegion, ...] = (),
        thin_map: FloatArray | None = None,
    ) -> None:
        self.source = source
        self.grid = grid
        self.max_depth = max_depth
        self.thin_regions = thin_regions
        self.thin_map = thin_map
        self.continuity = continuity
        self.passes = passes
        self.gain = gain
        self.one_sided = one_sided
        self.accuracy = accuracy
        self.filled_mask = source.filled_mask
        self.history = source.history
        vars(self)["arguments"] = arguments

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state | {"arguments": align_bricks(state["arguments"])})

    @property
    def preparation(self) -> tuple[str, ...]:  # type: ignore[override]  # computed here
        """See :class:`Texture`; the last step is the baking."""
        smoothed = {0: "not smoothed", 1: "smoothed locally once"}
        how = smoothed.get(self.passes, f"smoothed locally {self.passes} times")
        accuracy = self.accuracy
        depth = format_length(accuracy.worst_depth)
        deepest = format_length(max(accuracy.depths, default=0.0))
        onset = format_length(accuracy.onset)
        places = f"{accuracy.onset_places} " if accuracy.onset_places else ""
        presses = "depths"
        if accuracy.presses:
            ends = [format_length(end) for end in (accuracy.presses[0], accuracy.presses[-1])]
            presses = f"presses of {ends[0]} to {ends[1]} times the stiffness"
        missed = ": more than asked for, the memory allows no finer field"
        claim = ""
        q = f"q at most {self.gain.upper:.4g}"
        if self.claimed_gain is not None:
            claim = " the file claims:"
            if not math.isclose(self.claimed_gain, self.gain.upper, rel_tol=1e-4):
                q += f", computed from its coefficients: the file claims {self.claimed_gain:.4g}"
        text = (
            f"Law H baked as a potential field: {self.nodes} nodes,"
            f" {format_length(self.resolution)} apart, {how}; {q};{claim}"
            f" force {100 * accuracy.share:.2g} % RMS from exact H"
            f" at the worst of {len(accuracy.depths)} {presses} (at {depth}; deeper than {deepest}"
            f" it is not known){missed * accuracy.is_limited}; contact begins up to {onset} from"
            f" the surface at {places}sampled places"
        )
        return (*self.source.preparation, text)

    def __repr__(self) -> str:
        q = self.gain.upper
        return f"<PotentialField of {self.source!r}, {self.nodes} nodes, q at most {q:.4g}>"

    @property
    def resolution(self) -> float:
        """Greatest distance of nodes [m]."""
        return max(self.grid.spacing)

    @property
    def bytes(self) -> int:
        """Size of coefficients and columns in memory."""
        record = self.arguments
        return int(record.c.nbytes + record.bricks.nbytes + record.columns.nbytes)

    @property
    def nodes(self) -> int:
        """Number of stored coefficients; those of bricks include some beyond the columns."""
        return self.arguments.c.size + self.arguments.bricks[1:, BRICK_VALUES:].size

    @property
    def sampler(self) -> tuple[ModuleType, ...]:
        """See :class:`Texture`."""
        from asperity.textures.fields import field_sampler

        return field_sampler, *field_sampler.PARTS

    @cached_property
    def arguments(self) -> FieldArguments:
        """See :class:`Texture`; set when the field is made."""
        raise AttributeError("arguments")

    def describe(self) -> dict[str, Any]:
        """See :class:`Texture`; the whole field but for its record and the stored heights."""
        grid = self.grid
        source = self.source
        heights = self.stored_heights()
        names = ("max_depth", "continuity", "passes", "thin_regions")
        numbers = {name: getattr(self, name) for name in names}
        parts = {name: vars(getattr(self, name)) for name in ("gain", "one_sided", "accuracy")}
        nodes = {name: getattr(grid, name) for name in ("cells", "level_spacing", "floor")}
        nodes |= {name: getattr(grid, name).tolist() for name in ("steps", "start", "knots")}
        return {
            "kind": self.kind,
            "spacing": list(grid.spacing),
            "nodes": self.nodes,
            **to_plain_data(numbers | parts | {"grid": nodes}),
            "source": source.describe(),
            "preparation": list(source.preparation),
            "shape": list(heights.shape) if heights.size else [],
            **{name: np.ravel(getattr(source, name, ())).tolist() for name in ("pitch", "origin")},
            "periodic": source.domain.periodic,
        }

    def table_rows(self) -> list[dict[str, Any]]:
        """Return size and accuracy, in one row."""
        accuracy = self.accuracy
        record = self.arguments
        return [
            {
                "nodes": self.nodes,
                "spacing [m]": max(self.grid.spacing),
                "size [B]": record.c.nbytes + record.bricks.nbytes,
                "q": self.gain.upper,
                "share of force": accuracy.share,
                "greatest distance of onset [m]": accuracy.onset,
                "max depth [m]": self.max_depth,
            }
        ]

    # --- the texture that was baked ---------------------------------------------------------------

    extremes: Any = _of_source("extremes")
    bounds: Any = _of_source("bounds")
    domain: Any = _of_source("domain")
    third_derivative_bound: Any = _of_source("third_derivative_bound")
    waves: Any = _of_source("waves")
    is_mirrored: Any = _of_source("is_mirrored")
    scan_line: Any = _of_source("scan_line")
    cells: Any = _of_source("cells")
    line_segments: Any = _of_source("line_segments")
    sample_counts: Any = _of_source("sample_counts")
    grid_counts: Any = _of_source("grid_counts")
    samples: Any = _of_source("samples")
    texture_part: Any = _of_source("texture_part")
    nearest: Any = _of_source("nearest")
    stored_heights: Any = _of_source("stored_heights")
    _evaluate: Any = _of_source("_evaluate")

    # --- the force that is rendered ---------------------------------------------------------------

    @property
    def baked_numbers(self) -> Mapping[str, CertifiedNumber]:
        """See :class:`Texture`."""
        return {"norm": self.gain, "one-sided": self.one_sided}

    @property
    def is_body(self) -> bool:
        """See :class:`Texture`."""
        return self.arguments.border == ZERO

    @property
    def depth_limit(self) -> float:
        """See :class:`Texture`."""
        return self.max_depth

    def check_law(self, contact: Contact, parameters: Mapping[str, float]) -> None:
        """See :class:`Texture`.

        Raises:
            ParameterError: for a law other than H, or another continuity.
        """
        if not contact.has_potential_field:
            raise ParameterError("law", "must be H on a baked field: no other law was baked")
        if parameters["continuity"] != self.continuity:
            requirement = f"must be {self.continuity:.6g}, as baked"
            raise ParameterError("continuity", requirement, parameters["continuity"])

    @cached_property
    def digest(self) -> str | None:
        """See :class:`Texture`."""
        source = self.source.digest
        return source and content_digest(source, type(self).__qualname__, *self.arguments)
