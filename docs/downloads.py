"""The wheel and the source archive beside the site, so that whoever has the site has the code."""

import hashlib
import subprocess
import sys
from html import escape
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def build(folder: Path) -> list[Path]:
    """Build both into ``folder``, with what is installed. Returns the files."""
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.iterdir():
        old.unlink()
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(folder), str(ROOT)]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)}: exit code {done.returncode}\n{done.stdout}")
    return sorted(folder.iterdir())


def listed(files: list[Path]) -> str:
    """HTML of a list of the files, which lie in the folder ``downloads`` of the site, with sizes and digests."""
    return "\n".join(["<ul>", *map(_item, files), "</ul>"])


def _item(file: Path) -> str:
    content, name = file.read_bytes(), escape(file.name)
    digest = hashlib.sha256(content).hexdigest()
    what = "the wheel" if file.suffix == ".whl" else "the source, with tests, scenes and this site"
    return (
        f'<li><a href="../downloads/{name}">{name}</a>: {what}; {len(content) / 1e6:.1f} MB, '
        f"SHA-256 <code>{digest}</code></li>"
    )
