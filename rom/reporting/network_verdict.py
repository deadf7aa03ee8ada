"""Where a network wins, against whom, and at what price: sentences and tables of the whole population's results."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rom.reporting import html, words
from rom.reporting.full_scale import by, full_scale_count, full_scale_error, learned_cases, networks, population
from rom.reporting.results import Results


def network_verdict(found: Results) -> Iterator[str]:
    """Who is nearer and faster than whom, and what the training data cost; nothing where there are no networks."""
    split, methods = found.splits[0], networks(found)
    if not methods:
        return
    rivals = [m for m in found.reduced if m not in methods and np.isfinite(_error(found, m, split))]
    for method in methods:
        i, error = found.headline(method), _error(found, method, split)
        groups: dict[tuple[bool, bool], list[str]] = {}
        for rival in rivals:
            key = bool(error < _error(found, rival, split)), bool(found.online[i] < found.online[found.headline(rival)])
            groups.setdefault(key, []).append(rival)
        parts = [f"{what} {words.listed(groups[key])}" for key, what in (
            ((True, True), "nearer to the truth and faster than"), ((True, False), "nearer but slower than"),
            ((False, True), "faster but farther off than"), ((False, False), "farther off and slower than"))
            if key in groups]
        yield f"Where {method} wins, and against whom (one {found.noun}, largest error): {'; '.join(parts)}."
    most = max(methods, key=lambda m: learned_cases(found, m))
    one = found.seconds("batch")[found.baseline("batch")]
    if np.isfinite(one):
        i, cases, by_whom = found.headline(most), learned_cases(found, most), found.method[found.baseline("batch")]
        cost = found.per_entry("snapshot_seconds")[i]
        yield (f"The {cases:,} answers that {most} learned from cost {words.seconds(cost)}; {by_whom}, many at once, "
               f"would take {words.seconds(cases * one)}. A network of this accuracy presupposes a method that could "
               "have answered in its place.")


def _error(found: Results, method: str, split: str) -> float:
    """Largest error of a method's headline over as many held-out cases as it was judged on."""
    i = found.headline(method)
    return float(np.nanmax([found.errors(split)[i], full_scale_error(found, i, split)]))


def network_tables(found: Results) -> Iterator[str]:
    """Errors over the whole population and their price; then the parts of it that were kept from training."""
    if networks(found):
        yield _price_table(found)
        yield _parts_table(found)


def _price_table(found: Results) -> str:
    head = [html.named("method", "setting"), html.named("learned from", "cases")]
    for split in found.splits:
        head += [html.named(f"{split} split", "max / p95 / median"), html.named("judged", "held-out cases")]
    head += [html.named("training"), html.named("size"), html.named(f"one {found.noun}", "in a batch")]
    fit, size, learned = (found.per_entry(name) for name in ("fit_seconds", "model_bytes", "learned_cases"))
    rows = []
    for i, method in enumerate(found.method):
        if not full_scale_count(found, i, found.splits[0]):
            continue
        cells = [html.named(method, found.setting(i), found.style(method).colour), html.cell(words.count(learned[i]))]
        for split in found.splits:
            rest = " / ".join(words.error(full_scale_error(found, i, split, s)) for s in ("p95", "median"))
            count = full_scale_count(found, i, split)
            cells += [html.cell(words.error(full_scale_error(found, i, split)), rest if count else ""),
                      html.cell(f"{count:,}" if count else words.NONE)]
        cells += [html.cell(words.seconds(fit[i])), html.cell(words.size(size[i])),
                  html.cell(words.seconds(found.online[i]), words.seconds(found.seconds("batch")[i]))]
        rows.append(("headline" if i == found.headline(method) else "", cells))
    return html.table("Errors over the held-out cases of the whole published population; shaded: the settings that "
                      "stand for their methods. Methods without trained weights answered a random sample of them.",
                      head, rows)


def _parts_table(found: Results) -> str:
    names = [str(name) for name in found.data["full_scale_region"].values]
    shown = [(split, k) for j, split in enumerate(found.splits) for k, name in enumerate(names)
             if k and (j or "unseen" not in name)]
    hertz, height = found.per_entry("peak_frequency_error"), found.per_entry("peak_height_error")
    head = [html.named("method"), *(html.named(names[k], f"{split} split") for split, k in shown)]
    peaks = bool(np.isfinite(hertz).any())
    if peaks:
        head += [html.named("peak misplaced", "at most [Hz]"), html.named("peak's height", "at most off")]
    rows = []
    for method in population(found):
        i = found.headline(method)
        errors = [by(found, "full_scale_region", i, split)[k] for split, k in shown]
        cells = [html.named(method, colour=found.style(method).colour),
                 *(html.cell(words.error(e), kind="" if not e > found.gate else "fail") for e in errors)]
        if peaks:
            cells += [html.cell(words.significant(hertz[i], 2) if np.isfinite(hertz[i]) else words.NONE),
                      html.cell(words.error(height[i]))]
        rows.append(("", cells))
    told = f" Peaks: the highest of {int(found.scalar('peak_count'))} frequency responses." if peaks else ""
    return html.table("Largest error in parts of the whole population that were kept from training." + told, head, rows)
