"""The report page: verdict first, then the numbers, the figures, and how it was all measured."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

from rom.reporting import html, words
from rom.reporting.conclusions import conclusions
from rom.reporting.failures import failures
from rom.reporting.figure import Figure
from rom.reporting.full_scale import networks
from rom.reporting.network_verdict import network_table
from rom.reporting.results import Results
from rom.reporting.tables import headline_table, settings_table, speed_table


def page(found: Results, plates: Sequence[Figure]) -> str:
    """HTML of a scene's report; the images are named relative to it."""
    title = found.text("title", "Comparison of metamodels")
    sections = {
        "headline": ("Methods at their headline settings", [headline_table(found)]),
        "speed": ("Speed-up at a level of error", [speed_table(found, split) for split in found.splits]),
        **({"networks": ("Networks at full scale", [network_table(found)])} if networks(found) else {}),
        "figures": ("Figures", [html.image(p.file, p.alt, p.caption) for p in plates]),
        "failures": ("What did not work", [_failures(found)]),
        "scene": ("What the scene needs, and what it leaves out", _scene(found)),
        "methods": ("The methods", _methods(found)),
        "measured": ("How it was measured", [html.bullets(measured(found)), html.definitions(provenance(found))]),
        "settings": ("All settings", [settings_table(found)]),
    }
    links = " ".join(f'<a href="#{anchor}">{html.text(name)}</a>' for anchor, (name, _) in sections.items())
    head = [f"<h1>{html.text(title)}</h1>", html.paragraph(found.text("question"), "question")]
    if int(found.data.attrs.get("quick", 0)):
        head.append(html.paragraph("A quick run: few cases, few repeats, short training. It shows that everything "
                                   "works; its numbers are no basis for a decision.", "notice"))
    body = [html.section(anchor, name, *parts) for anchor, (name, parts) in sections.items()]
    return html.document(title, [*head, html.bullets(conclusions(found.data), "verdict"), f"<nav>{links}</nav>", *body])


def index(scenes: Sequence[tuple[str, str, str]], experiments: Sequence[tuple[str, str, str]]) -> str:
    """HTML of the front page: title, path and one sentence of each comparison and each experiment."""
    title = "Reduced-order models of the human fingertip"
    body = [f"<h1>{html.text(title)}</h1>",
            html.paragraph("Direct finite elements, modal superposition, POD and networks on the same fingertip: "
                           "error, run time and preparation, measured in one protocol.", "question")]
    for name, path, verdict in scenes:
        body.append(f'<h2><a href="{escape(path)}">{html.text(name)}</a></h2>\n{html.paragraph(verdict)}')
    if experiments:
        entries = [f'<dt><a href="{escape(path)}">{html.text(name)}</a></dt><dd>{html.text(finding)}</dd>'
                   for name, path, finding in experiments]
        body.append(html.section("experiments", "Experiments: one question each", "<dl>", *entries, "</dl>"))
    return html.document(title, body)


def _failures(found: Results) -> str:
    sentences = failures(found)
    return html.bullets(sentences) if sentences else html.paragraph("Nothing that this comparison could notice.")


def _scene(found: Results) -> list[str]:
    parts = []
    for name, title in (("scene_needs", "It needs"), ("scene_leaves_out", "It leaves out")):
        record = found.record(name)
        if record:
            parts += [f"<h3>{title}</h3>", html.definitions(record)]
    return parts or [html.paragraph("The results do not say.")]


def _methods(found: Results) -> list[str]:
    summaries = found.record("method_summaries") or {}
    parts = [html.definitions({name: summaries.get(name, "") for name in found.methods})] if summaries else []
    away = found.record("not_applicable")
    if away:
        parts += ["<h3>Not applicable here</h3>", html.definitions(away)]
    return parts or [html.paragraph("The results do not say.")]


def measured(found: Results) -> list[str]:
    """Sentences on the protocol, with this run's own numbers."""
    sentences = [
        found.text("error_definition", "Error of a case: length of the difference over length of the truth, over all "
                   "free degrees of freedom, complex where the answer is.")
        + " The gate looks at the largest error over the held-out cases.",
        f"Truth: `direct`, {found.text('backend', 'solver not recorded')}"
        + (f"; the largest relative residual of a stored case is {words.error(_attribute(found, 'residual_max'))}."
           if np.isfinite(_attribute(found, "residual_max")) else "."),
        "Times: wall clock in nanoseconds (`perf_counter_ns`) after a warm-up, methods interleaved, the median of "
        f"{words.plural(found.data.sizes['repeat'], 'repeat')}; speed-ups are ratios of medians. Inputs and outputs "
        "are the same for every method, reconstruction of the field and copies included; the labelled call is told "
        "apart."]
    sizes = found.per_entry("batch_size")
    known = np.unique(sizes[np.isfinite(sizes)]).astype(int)
    if len(known):
        sentences.append(f"Batches hold {words.listed([f'{n:,}' for n in known])} cases, according to the method.")
    train, test = found.record("n_train") or {}, found.record("n_test") or {}
    for split in found.splits:
        if split in train and split in test:
            sentences.append(f"The {split} split: {train[split]:,} training cases, {test[split]:,} held-out cases.")
    fewer = [name for name in found.methods if any(0 < judged < most for judged, most in (
        found.judged(found.headline(name), split) for split in found.splits))]
    if fewer:
        sentences.append(f"Errors of {words.listed(fewer)} are over fewer held-out cases than the others'; the first "
                         "table says how many.")
    if found.regions:
        sentences.append(f"The {found.splits[-1]} split keeps from training: {'; '.join(found.regions)}.")
    return sentences


def provenance(found: Results) -> dict[str, str]:
    """What one needs to repeat the run."""
    names = {"machine": "machine", "threads": "threads", "backend": "solver", "software_versions": "software",
             "commit": "commit", "seed": "seed", "n_nodes": "nodes", "n_free": "free degrees of freedom",
             "created": "made"}
    pairs = {title: found.text(name) for name, title in names.items() if name in found.data.attrs}
    for title in ("nodes", "free degrees of freedom"):
        if pairs.get(title, "").isdigit():
            pairs[title] = f"{int(pairs[title]):,}"
    return pairs


def _attribute(found: Results, name: str) -> float:
    return float(found.data.attrs.get(name, float("nan")))
