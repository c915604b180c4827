"""Pictures of pages."""

from __future__ import annotations

from io import BytesIO

import matplotlib as mpl
from matplotlib import pyplot
from matplotlib.figure import Figure

mpl.use("Agg")


def png(figure: Figure) -> bytes:
    """The content of a PNG file of a figure, which is closed."""
    figure.tight_layout()
    content = BytesIO()
    figure.savefig(content, format="png", dpi=150)
    pyplot.close(figure)
    return content.getvalue()
