"""Self-contained web page of a report, with zoomable figures."""

import html
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.offline import get_plotlyjs

from ab_sim.base.errors import visible
from ab_sim.base.files import write_whole
from ab_sim.show.panels import TIME, Grid, Panel
from ab_sim.show.styles import GREY, MAP
from ab_sim.show.summary import CAPTION, Row

_HEIGHT = 270
"""Height in pixels of a panel of height 1."""
_STYLE = """
body { font-family: sans-serif; margin: 1.5em; color: #222; }
table { border-collapse: collapse; margin-bottom: 0.5em; }
th, td { text-align: left; padding: 0.25em 1.2em 0.25em 0.3em; border-bottom: 1px solid #ccc; }
p { max-width: 60em; color: #444; }
.runs { display: grid; gap: 0.6em; }
.runs h2 { margin: 0.5em 0 0 0; font-size: 1.1em; }
.runs h3 { margin: 0.3em 0 0 0; font-size: 0.95em; font-weight: normal; text-align: center; }
.runs div { min-width: 0; }
.table { overflow-x: auto; }
.run { display: none; }
@media (max-width: 700px) {
  body { margin: 0.5em; }
  .runs { grid-template-columns: minmax(0, 1fr) !important; }
  .runs h2 { display: none; }
  .run { display: inline; }
}
"""
# Panels over time are zoomed together.
_SCRIPT = """
const timed = [...document.querySelectorAll('.time .plotly-graph-div')];
let linking = false;
for (const one of timed) one.on('plotly_relayout', change => {
  if (linking) return;
  const from = change['xaxis.range[0]'], to = change['xaxis.range[1]'];
  const whole = change['xaxis.autorange'] || (from === undefined && change['xaxis.range']);
  if (from === undefined && !whole) return;
  linking = true;
  const update = from !== undefined ? {'xaxis.range': [from, to]}
    : {'xaxis.range': [...one.layout.xaxis.range]};
  Promise.all(timed.filter(other => other !== one).map(other => Plotly.relayout(other, update)))
    .then(() => { linking = false; });
});
"""


def report_page(
    grid: Grid, rows: Sequence[Row], notes: Sequence[Sequence[str]], path: Path
) -> None:
    """Write a report on runs, side by side, as a web page.

    Parameters
    ----------
    grid
        Panels to show.
    rows
        Rows of the table above the panels.
    notes
        Notes on each run.
    path
        File to write, with the ending .html.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    title = "Report: " + ", ".join(grid.names)
    heads = "".join(f"<th>{escaped(name)}</th>" for name in ("", *grid.names))
    table = "".join(
        f"<tr><th>{escaped(label)}</th>"
        + "".join(f"<td>{escaped(cell)}</td>" for cell in cells)
        + "</tr>\n"
        for label, cells in rows
    )
    notes_text = "".join(
        f"<p><b>{escaped(name)}</b>: {escaped(note)}</p>\n"
        for name, text in zip(grid.names, notes, strict=True)
        for note in text
    )
    columns = f"grid-template-columns: repeat({len(grid.names)}, minmax(0, 1fr))"
    body = "".join(f"<h2>{escaped(name)}</h2>\n" for name in grid.names)
    for panels in grid.rows:
        for name, panel in zip(grid.names, panels, strict=True):
            body += "<div></div>\n" if panel is None else _division(name, panel)
    write_page(
        path,
        title,
        f'<div class="table"><table><tr>{heads}</tr>\n{table}</table></div>\n'
        f"<p>{escaped(CAPTION)}</p>\n{notes_text}"
        f'<div class="runs" style="{columns}">\n{body}</div>\n<script>{_SCRIPT}</script>',
    )


def write_page(path: Path, title: str, body: str) -> None:
    """Write a page that includes everything its figures need.

    Parameters
    ----------
    path
        File to write, with the ending .html.
    title
        Title, not yet escaped.
    body
        HTML below the title.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    text = (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escaped(title)}</title>\n<style>{_STYLE}</style>\n"
        f"<script>{get_plotlyjs()}</script></head>\n<body><h1>{escaped(title)}</h1>\n{body}"
        "</body></html>\n"
    )
    write_whole(path, text.encode())


def escaped(text: str) -> str:
    """Escape an untrusted text for HTML."""
    return html.escape(visible(text))


def _division(name: str, panel: Panel) -> str:
    """Return a run's panel and title as HTML; the class tells the script which panels to zoom."""
    kind = "time" if panel.across == TIME else "other"
    head = f'<h3><span class="run">{escaped(name)}: </span>{escaped(panel.title)}</h3>'
    return f'<div class="{kind}">{head}{panel_html(panel)}</div>\n'


def panel_html(panel: Panel) -> str:
    """Return a panel as HTML for a part of a page."""
    drawn: str = _figure(panel).to_html(
        full_html=False, include_plotlyjs=False, config={"displaylogo": False, "responsive": True}
    )
    return drawn


def _figure(panel: Panel) -> Any:
    """Return a panel as a figure of plotly."""
    figure = go.Figure()
    if panel.heat is not None:
        figure.add_heatmap(
            x=panel.heat.x, y=panel.heat.y, z=panel.heat.values.astype(np.float32),
            colorscale=MAP, colorbar={"title": {"text": panel.heat.label, "side": "right"}},
        )  # fmt: skip
    if panel.cloud is not None:
        bar = {"title": {"text": TIME, "side": "right"}}
        time = panel.cloud.time
        figure.add_scattergl(
            x=_short(panel.cloud.x), y=_short(panel.cloud.y), mode="markers", showlegend=False,
            marker={"color": _short(time), "colorscale": MAP, "size": 3, "colorbar": bar},
            customdata=_short(time), hovertemplate="%{customdata:.4f} s<br>%{x}, %{y} mm",
        )  # fmt: skip
    for curve in panel.curves:
        dash = ",".join(f"{part:g}px" for part in curve.dashes) or "solid"
        line = {"color": curve.colour, "width": curve.width, "dash": dash}
        figure.add_scatter(
            x=_short(curve.x), y=_short(curve.y), name=curve.name, line=line, mode="lines"
        )
    for value, name in panel.levels:
        figure.add_hline(
            value, line={"color": GREY, "width": 1, "dash": "dot"}, annotation_text=name,
            annotation_position="top right", annotation_font_size=10,
        )  # fmt: skip
    if panel.note:
        figure.add_annotation(text=panel.note, showarrow=False, x=0.5, y=0.5, xref="x domain")
    across, up = (list(np.log10(limit) if log else limit) for limit, log in zip(
        panel.limits, (False, panel.log), strict=True
    ))  # fmt: skip
    figure.update_layout(
        height=_HEIGHT * panel.height + 80, margin={"l": 75, "r": 20, "t": 30, "b": 50},
        template="simple_white", hovermode="closest",
        legend={"orientation": "h", "x": 0.0, "xanchor": "left", "y": 1.0, "yanchor": "bottom"},
    )  # fmt: skip
    figure.update_xaxes(title=panel.across, range=across, showgrid=True, visible=not panel.note)
    figure.update_yaxes(
        title=panel.up, range=up, type="log" if panel.log else "linear", showgrid=True,
        visible=not panel.note, exponentformat="power", dtick=1 if panel.log else None,
    )  # fmt: skip
    if panel.equal:
        figure.update_yaxes(scaleanchor="x", scaleratio=1)
        figure.update_xaxes(constrain="domain")
    return figure


def _short(values: np.ndarray) -> np.ndarray:
    """Return values in single precision, which halves the page's size without a visible change."""
    return np.asarray(values, np.float32)
