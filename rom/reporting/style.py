"""The style sheet of the pages: one column that a screen shows and a printer prints, no outside address."""

from __future__ import annotations

CSS = """
:root { --ink: #1c1c1c; --quiet: #595959; --line: #d9d9d9; --good: #14532d; --bad: #9b1c1c; }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 1320px; padding: 1.5rem 1.75rem 4rem; color: var(--ink); background: #fff;
  font: 16px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif; }
h1 { font-size: 1.8rem; line-height: 1.2; margin: 0.5rem 0 0.25rem; }
h2 { font-size: 1.25rem; margin: 2.5rem 0 0.6rem; border-bottom: 1px solid var(--line); padding-bottom: 0.2rem; }
.question { color: var(--quiet); font-size: 1.1rem; margin: 0 0 1rem; }
.notice { background: #fff4d6; border-left: 4px solid #b7791f; padding: 0.5rem 0.9rem; }
.verdict { background: #f3f6fa; border-left: 4px solid #332288; padding: 0.7rem 1rem 0.7rem 2rem; margin: 1rem 0; }
.verdict li { margin: 0.35rem 0; max-width: 62rem; }
.verdict li:first-child { font-weight: 600; }
nav { font-size: 0.9rem; margin: 0.5rem 0; }
nav a { margin-right: 1rem; white-space: nowrap; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: 0.86rem; margin: 0.5rem 0; font-variant-numeric: tabular-nums; }
caption { text-align: left; color: var(--quiet); padding-bottom: 0.4rem; }
th, td { padding: 0.3rem 0.55rem; text-align: right; vertical-align: top; border-bottom: 1px solid var(--line); }
th { font-weight: 600; }
thead th { vertical-align: bottom; border-bottom: 2px solid var(--ink); }
th:first-child, td.text, th.text { text-align: left; }
th:first-child, td:not(.text) { white-space: nowrap; }
td small, th small { display: block; color: var(--quiet); font-weight: 400; white-space: normal; }
tr.headline th, tr.headline td { background: #f3f6fa; }
.pass { color: var(--good); font-weight: 600; }
.fail { color: var(--bad); font-weight: 600; }
.swatch { display: inline-block; width: 0.7em; height: 0.7em; border-radius: 2px; margin-right: 0.4em; }
figure { margin: 1.5rem 0 2rem; }
figure img { display: block; width: 100%; height: auto; }
figcaption { color: var(--quiet); font-size: 0.9rem; margin-top: 0.4rem; }
dl { display: grid; grid-template-columns: minmax(9rem, 15rem) 1fr; gap: 0.3rem 1.2rem; }
dt { font-weight: 600; } dd { margin: 0; overflow-wrap: anywhere; }
code { font-size: 0.92em; background: #f3f3f3; padding: 0 0.25em; border-radius: 3px; }
@media print {
  body { max-width: none; padding: 0; font-size: 10pt; } nav { display: none; }
  figure, tr, .verdict { break-inside: avoid; } h2 { break-after: avoid; } .wide { overflow: visible; }
  table { font-size: 7.5pt; } th, td { padding: 0.15rem 0.25rem; }
  * { -webkit-print-color-adjust: exact; print-color-adjust: exact; }
}
"""
