"""What a page may load and run: its Content-Security-Policy, which names the scripts and styles within it by digest."""

from __future__ import annotations

import base64
import hashlib
import re

_INLINE = re.compile(r"<(script|style)(?![^>]*\ssrc=)[^>]*>(.*?)</\1>", re.DOTALL)


def policy(html: str, *, scripts: tuple[str, ...], others: tuple[str, ...]) -> str:
    """The policy of a page.

    Parameters
    ----------
    html : str
        The page.
    scripts : tuple of str
        Where scripts may come from, beside those within the page.
    others : tuple of str
        Where styles, and what the page itself asks for, may come from.
    """
    digests: dict[str, list[str]] = {"script": [], "style": []}
    for kind, text in _INLINE.findall(html):
        digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
        digests[kind].append(f"'sha256-{digest}'")
    allowed = {"default-src": (), "script-src": (*scripts, *digests["script"]),
               "style-src": (*others, *digests["style"]), "connect-src": others, "img-src": (*others, "data:", "blob:"),
               "base-uri": (), "form-action": ()}
    return "; ".join(" ".join([name, *(sources or ["'none'"])]) for name, sources in allowed.items())
