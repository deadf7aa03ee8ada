"""The page as one file to mail: scripts, styles and the modal ROM of the surface, no server behind it."""

from __future__ import annotations

import base64
import gzip
import json
import re
from pathlib import Path

import numpy as np

from rom.files import whole_file
from rom.interactive.policy import policy
from rom.interactive.surface_model import HIGHEST_HZ, LOSS_FACTORS, compress, deviation, from_bytes, to_bytes
from rom.metamodels.modal import ModalKrylov

PAGE = Path(__file__).parent / "page"
MARK = "<!-- written by rom export-page -->"
"""Stands in the first line of every exported page, so that only such files are replaced."""
ALLOWED_DEVIATION = 1e-3
"""From `modal-krylov`: relative, of the pad's field; a file that is off by more is not written."""
SAMPLED_HZ = np.linspace(0.0, HIGHEST_HZ, 7)
SAMPLED_LOSS = np.array([LOSS_FACTORS[0], 0.1, LOSS_FACTORS[1]])
STYLES = ("vendor/uplot/uPlot.min.css", "style.css")
_IMPORT = re.compile(r"""(\b(?:from|import)\s*)(["'])([\w./]+)\2""")
_IMPORT_MAP = re.compile(r'<script type="importmap">(.*?)</script>\n', re.DOTALL)

BOOT = """
const unpack = async id => {
  const bytes = Uint8Array.from(atob(document.getElementById(id).textContent), c => c.charCodeAt(0));
  const whole = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(whole).arrayBuffer();
};
(async () => {
  const urls = {};
  for (const [name, text] of JSON.parse(new TextDecoder().decode(await unpack("modules")))) {
    const linked = text.replace(/MODULE:([\\w.\\/]+)/g, (_, other) => urls[other]);
    urls[name] = URL.createObjectURL(new Blob([linked], {type: "text/javascript"}));
  }
  const [{start}, {ModalEngine}] = await Promise.all([import(urls["main.js"]), import(urls["modal_engine.js"])]);
  await start(new ModalEngine(await unpack("model")));
})().catch(error => {
  const hint = document.getElementById("hint");
  hint.textContent = `This browser cannot run the page (${error.message}): use one of 2023 or later.`;
  hint.className = "problem";
});
"""


def check_path(path: Path) -> None:
    """Refuse what must not be overwritten, before any work.

    Parameters
    ----------
    path : Path

    Raises
    ------
    ValueError
        For another ending than .html, a folder, a missing folder, or a file that is no exported page.
    """
    if path.suffix != ".html":
        raise ValueError(f"the page got the name {str(path)!r}, but it must end in .html: rename it")
    if path.is_dir():
        raise ValueError(f"{str(path)!r} is a folder: name a file in it")
    if not path.parent.is_dir():
        raise ValueError(f"{str(path)!r} cannot be written, as the folder {path.parent} does not exist: make it first")
    if path.exists():
        with open(path, "rb") as file:
            if MARK.encode() not in file.read(200):
                raise ValueError(f"{str(path)!r} exists and is no exported page: choose another name, or remove it")


def export_page(model: ModalKrylov, path: str | Path) -> dict[str, float]:
    """Write the page with the model's surface inside, whole or not at all.

    Parameters
    ----------
    model : ModalKrylov
        Fitted.
    path : str or Path
        Ends in .html; an exported page is replaced, anything else is left alone.

    Returns
    -------
    dict
        ``bytes`` of the file and what :func:`deviation` found, decoded from the very bytes that were written.

    Raises
    ------
    ValueError
        For a path that :func:`check_path` refuses, or numbers off by more than :data:`ALLOWED_DEVIATION`.
    OSError
        Where the file cannot be written.
    """
    path = Path(path)
    check_path(path)
    small = compress(model)
    measured = deviation(model, from_bytes(to_bytes(small)), SAMPLED_HZ, SAMPLED_LOSS)
    worst = max(measured[name] for name in ("field", "norm", "probe"))
    if not worst <= ALLOWED_DEVIATION:
        raise ValueError(f"the page would be off by {worst:.1e} from modal-krylov, and {ALLOWED_DEVIATION:g} is the "
                         "most: fit it with more modes")
    small.header["measured"] = measured
    text = page_text(to_bytes(small))
    with whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return {"bytes": len(text.encode()), **measured}


def page_text(model: bytes) -> str:
    """The exported page around a packed model."""
    text = (PAGE / "index.html").read_text(encoding="utf-8")
    styles = "\n".join((PAGE / name).read_text(encoding="utf-8") for name in STYLES)
    modules = [list(one) for one in _modules(text, "main.js", "modal_engine.js").items()]
    inside = (f"<style>\n{styles}\n</style>\n"
              f'<script type="text/plain" id="licences">\n{_licences()}\n</script>\n')
    packed = (f'<script type="text/plain" id="modules">{_packed(json.dumps(modules).encode())}</script>\n'
              f'<script type="text/plain" id="model">{_packed(model)}</script>\n<script>{BOOT}</script>\n')
    text = re.sub(r'<link rel="stylesheet"[^>]*>\n', "", text)
    text = _IMPORT_MAP.sub("", text)
    text = re.sub(r'<script type="module"[^>]*></script>\n', lambda _: inside, text)
    text = text.replace("</body>", f"{packed}</body>")
    own = policy(f"<style>\n{styles}\n</style><script>{BOOT}</script>", scripts=("blob:",), others=())
    text = text.replace("<head>\n", f'<head>\n<meta http-equiv="Content-Security-Policy" content="{own}">\n', 1)
    return text.replace("<!DOCTYPE html>", f"<!DOCTYPE html>{MARK}", 1)


def _modules(html: str, *names: str) -> dict[str, str]:
    """Texts of modules and of all that they import, by name, each after those; imports are marked ``MODULE:name``."""
    bare = json.loads(_IMPORT_MAP.search(html)[1])["imports"]  # type: ignore[index]
    found: dict[str, str] = {}

    def add(path: Path) -> str:
        name = path.relative_to(PAGE).as_posix()
        if name not in found:
            found[name] = ""  # its own comments name it
            text = path.read_text(encoding="utf-8")
            text = _IMPORT.sub(lambda one: f'{one[1]}"MODULE:{add(of(one[3], path))}"', text)
            del found[name]
            found[name] = text
        return name

    def of(target: str, path: Path) -> Path:
        return PAGE.parent / bare[target] if target in bare else path.parent / target

    for name in names:
        add(PAGE / name)
    return found


def _packed(data: bytes) -> str:
    return base64.b64encode(gzip.compress(data, 9, mtime=0)).decode()


def _licences() -> str:
    return "\n\n".join(f"{folder}\n{(PAGE / 'vendor' / folder / 'LICENSE').read_text(encoding='utf-8')}"
                       for folder in ("three", "uplot"))
