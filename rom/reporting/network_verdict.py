"""Where a network wins, against whom, and at what price: sentences and a table computed from the results."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rom.reporting import html, palette, words
from rom.reporting.full_scale import by, full_scale_count, full_scale_error, learned_cases, networks, population
from rom.reporting.results import DIRECT, LEARNED, SOLVERS, Results

REAL_TIME = 1e-2
"""One answer of a network within so many seconds can follow a hand."""


def network_verdict(found: Results) -> Iterator[str]:
    """Everything that the full-scale study says about networks; nothing where there is none."""
    methods = networks(found)
    if not methods:
        return
    for part in (_gates, _wins, _price, _extrapolation, _peaks, _speed, _precision, _fewer):
        yield from part(found, methods)


def _gates(found: Results, methods: list[str]) -> Iterator[str]:
    for method in methods:
        i = found.headline(method)
        text = f"{found.name(i)}, from {learned_cases(found, method):,} cases"
        for split in found.splits:
            count = full_scale_count(found, i, split)
            if count:
                text += (f"; {split} split, all {count:,} held-out cases within the published ranges: at most "
                         f"{words.error(full_scale_error(found, i, split))} off, "
                         f"{words.error(full_scale_error(found, i, split, 'median'))} in the median")
        yield text + "."


def _wins(found: Results, methods: list[str]) -> Iterator[str]:
    """Against each opponent's headline: who is nearer, who is faster."""
    split = found.splits[0]
    rivals = [m for m in found.methods if m not in (*methods, *SOLVERS) and np.isfinite(_error(found, m, split))]
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
        yield f"Where {method} wins, and against whom (one case, largest error): {'; '.join(parts)}."


def _error(found: Results, method: str, split: str) -> float:
    """Largest error of a method's headline over as many held-out cases as it was judged on."""
    i = found.headline(method)
    return float(np.nanmax([found.errors(split)[i], full_scale_error(found, i, split)]))


def _price(found: Results, methods: list[str]) -> Iterator[str]:
    snapshots, fit = found.per_entry("snapshot_seconds"), found.per_entry("fit_seconds")
    one = found.per_entry("batch_seconds")[found.direct]
    each = words.listed([f"{m} {words.seconds(fit[found.headline(m)])}" for m in methods])
    yield f"Training took: {each}."
    most = max(methods, key=lambda m: learned_cases(found, m))
    i, cases = found.headline(most), learned_cases(found, most)
    if found.harmonic and np.isfinite(one):
        yield (f"The {cases:,} answers that {most} learned from cost {words.seconds(snapshots[i])}, since a reduced "
               f"model made them; {DIRECT} would take {words.seconds(cases * one)}. A network of this accuracy "
               "presupposes a method that could have answered in its place.")


def _extrapolation(found: Results, methods: list[str]) -> Iterator[str]:
    names = [str(name) for name in found.data["full_scale_region"].values]
    for j, split in enumerate(found.splits):
        shown = range(1, len(names)) if j else [k for k, name in enumerate(names) if "unseen" not in name and k]
        for k in shown:
            errors = {m: by(found, "full_scale_region", found.headline(m), split)[k] for m in population(found)
                      if m in methods or m in LEARNED or m == "modal-krylov"}
            known = {m: e for m, e in errors.items() if np.isfinite(e)}
            if known:
                each = words.listed([f"{m} {words.error(e)}" for m, e in sorted(known.items(), key=lambda x: x[1])])
                yield f"{names[k][0].upper() + names[k][1:]} ({split} split), largest error: {each}."


def _peaks(found: Results, methods: list[str]) -> Iterator[str]:
    hertz, height = found.per_entry("peak_frequency_error"), found.per_entry("peak_height_error")
    known = [m for m in population(found) if np.isfinite(hertz[found.headline(m)])]
    if known:
        each = [f"{m} {words.significant(hertz[found.headline(m)], 2)} Hz and {words.error(height[found.headline(m)])}"
                for m in sorted(known, key=lambda m: height[found.headline(m)])]
        yield (f"The highest resonance peak of {int(found.scalar('peak_count'))} frequency responses of the pad is "
               f"misplaced by at most, and wrong in height by at most: {'; '.join(each)}.")


def _speed(found: Results, methods: list[str]) -> Iterator[str]:
    batch = found.per_entry("batch_seconds")
    rival = next((m for m in ("modal-krylov", "superposition") if m in found.methods), DIRECT)
    k = found.headline(rival)
    each = [f"{m} {words.seconds(found.online[i])} ({words.seconds(batch[i])} a case in a batch)"
            for m, i in ((m, found.headline(m)) for m in methods)]
    slow = [m for m in methods if found.online[found.headline(m)] > REAL_TIME]
    yield (f"One full field, batch of one, in the same run: {words.listed(each)}; {rival} "
           f"{words.seconds(found.online[k])} ({words.seconds(batch[k])}). "
           + (f"Slower than {words.seconds(REAL_TIME)}: {words.listed(slow)}." if slow
              else f"All networks stay below {words.seconds(REAL_TIME)}."))


def _precision(found: Results, methods: list[str]) -> Iterator[str]:
    texts = []
    for method in methods:
        single = found.headline(method)
        twin = [i for i in found.entries(method) if found.setting(i) == f"{found.setting(single)} precision=float64"]
        if twin:
            errors, slower = found.errors(found.splits[0]), found.online[twin[0]] / found.online[single]
            texts.append(f"{method} takes {words.ratio(slower)} as long, off by {words.error(errors[twin[0]])} instead "
                         f"of {words.error(errors[single])}")
    if texts:
        yield f"Fields in double instead of single precision: {'; '.join(texts)}."


def _fewer(found: Results, methods: list[str]) -> Iterator[str]:
    if "fewer_error_max" not in found.data:
        return
    counts = found.data["snapshots"].values
    table = found.data["fewer_error_max"].transpose("learner", "snapshots").values
    each = [f"{name} {words.error(row[0])} and {words.error(row[-1])}"
            for name, row in zip(found.data["learner"].values.astype(str), table, strict=True)]
    yield (f"From only {int(counts[0]):,} and {int(counts[-1]):,} snapshots the largest errors are: "
           f"{'; '.join(each)}.")


def network_table(found: Results) -> str:
    """Every entry that was judged on the whole population: cases, errors, price; empty where there is none."""
    if not networks(found):
        return ""
    head = [html.named("method", "setting"), html.named("learned from", "cases")]
    for split in found.splits:
        head += [html.named(f"{split} split", "max / p95 / median"), html.named("judged", "held-out cases")]
    head += [html.named("training"), html.named("size"), html.named("one case", "full field")]
    fit, size, learned = (found.per_entry(name) for name in ("fit_seconds", "model_bytes", "learned_cases"))
    rows = []
    for i, method in enumerate(found.method):
        if not full_scale_count(found, i, found.splits[0]):
            continue
        cells = [html.named(method, found.setting(i), palette.style(method).colour),
                 html.cell(words.count(learned[i]) if np.isfinite(learned[i]) else words.NONE)]
        for split in found.splits:
            rest = " / ".join(words.error(full_scale_error(found, i, split, s)) for s in ("p95", "median"))
            count = full_scale_count(found, i, split)
            cells += [html.cell(words.error(full_scale_error(found, i, split)), rest if count else ""),
                      html.cell(f"{count:,}" if count else words.NONE)]
        cells += [html.cell(words.seconds(fit[i])), html.cell(words.size(size[i])),
                  html.cell(words.seconds(found.online[i]))]
        rows.append(("headline" if i == found.headline(method) else "", cells))
    return html.table("Errors over the held-out cases of the whole published population; headline settings are shaded. "
                      "Methods without trained weights answered a random sample of these cases.", head, rows)
