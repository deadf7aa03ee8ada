"""How it was measured: the protocol with this run's own numbers, what the scene needs, what one needs to repeat it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from rom.reporting import words
from rom.reporting.results import Results

PROVENANCE = {"machine": "machine", "threads": "threads", "backend": "solver", "software_versions": "software",
              "commit": "commit", "seed": "seed", "n_nodes": "nodes", "n_free": "free degrees of freedom",
              "created": "made", "fingertip": "fingertip"}
"""Attributes of results that every page prints, and what they are called there."""


def provenance(attributes: Mapping[str, object]) -> dict[str, str]:
    """What one needs to repeat a run."""
    return {title: f"{int(str(attributes[name])):,}" if name.startswith("n_") else str(attributes[name])
            for name, title in PROVENANCE.items() if name in attributes}


def protocol(found: Results) -> Iterator[str]:
    """Sentences on the protocol."""
    yield found.text("error_definition", "Error of a case: length of the difference over length of the truth, over all "
                     "free degrees of freedom, complex where the answer is.") + (
        " The gate looks at the largest error over the held-out cases.")
    residual = found.number("residual_max")
    rest = f"; largest relative residual of a stored case {words.error(residual)}" if np.isfinite(residual) else ""
    yield f"Truth: `{found.truth}`, {found.text('backend', 'solver not recorded')}{rest}."
    yield ("Settings were chosen by the errors of validation cases, neither learned from nor judged." if found.validated
           else "Settings that a sentence or a table picks as the cheapest or the best were picked by the held-out "
                "errors that stand beside them, which flatters them a little; those that stand for their methods were "
                "not.")
    yield ("Times: wall clock in nanoseconds (`perf_counter_ns`), methods interleaved, the median of "
           f"{words.plural(found.data.sizes['repeat'], 'repeat')}, each right after a call of the same method"
           + ("; calls after all other methods ran (cold) and the very first ones are told apart."
              if "cold_seconds" in found.data else "."))
    yield ("Speed-ups are ratios of medians, over the fastest method that solves the full model at the same work. "
           "Inputs and outputs are the same for every method, reconstruction and copies included; what users call, "
           "`predict` with labels, is told apart.")
    sizes = found.per_entry("batch_size")
    known = np.unique(sizes[np.isfinite(sizes)]).astype(int)
    if len(known):
        yield f"Batches hold {words.listed([f'{n:,}' for n in known])} {found.noun}s, according to the method."
    train, test = found.record("n_train") or {}, found.record("n_test") or {}
    for split in found.splits:
        if split in train and split in test:
            yield f"The {split} split: {train[split]:,} training {found.noun}s, {test[split]:,} held out."
    fewer = [name for name in found.methods if any(0 < judged < most for judged, most in (
        found.judged(found.headline(name), split) for split in found.splits))]
    if fewer:
        yield (f"Errors of {words.listed(fewer)} are over fewer held-out cases than the others'; the table of methods "
               "says how many.")
    if found.number("n_ended") > 0:
        yield f"{words.plural(int(found.number('n_ended')), found.noun)} of the truth ended early."
    if found.regions:
        yield f"The {found.splits[-1]} split keeps from training: {'; '.join(found.regions)}."


def records(found: Results) -> dict[str, dict[str, str]]:
    """Lists of names and meanings, by heading: methods, what does not apply, needs, what is left out, provenance."""
    summaries = found.record("method_summaries") or {}
    lists = {"The methods": {name: summaries[name] for name in found.methods if name in summaries},
             "Not applicable here": found.record("not_applicable"), "The scene needs": found.record("scene_needs"),
             "It leaves out": found.record("scene_leaves_out"), "Where it came from": provenance(found.data.attrs)}
    return {heading: pairs for heading, pairs in lists.items() if pairs}
