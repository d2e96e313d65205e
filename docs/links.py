#!/usr/bin/env python3
"""Check a built site without a network: every link within it leads to a page, a file and an anchor that are there, and
none to a server on the machine that built it, which no reader has.

python docs/links.py build/site
"""

import sys
from html.parser import HTMLParser
from ipaddress import ip_address
from pathlib import Path
from urllib.parse import unquote, urlsplit

# Attributes that hold an address: links, pictures, frames, films, and the data of objects.
LINKS = ("href", "src", "poster", "data", "action")


class Page(HTMLParser):
    """The links and anchors of a page."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.links: list[str] = []
        self.anchors: set[str] = set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name in ("id", "name") and value:
                self.anchors.add(value)
            elif name in LINKS and value and tag != "base":
                self.links.append(value)
            elif name == "srcset" and value:
                self.links += [part.split()[0] for part in value.split(",") if part.strip()]


def is_here(host: str | None) -> bool:
    """Whether ``host`` names the machine itself: localhost, a loopback address, or the address of all its own."""
    if host is None or host == "localhost" or host.endswith(".localhost"):
        return host is not None
    try:
        address = ip_address(host)
    except ValueError:
        return False
    return address.is_loopback or address.is_unspecified


def main(site: Path) -> int:
    pages = {path.resolve(): Page(path) for path in sorted(site.rglob("*.html"))}
    broken, outside, count = [], set(), 0
    for path, page in pages.items():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                outside.add(link)
                if is_here(parts.hostname):
                    broken.append(f"{path.relative_to(site.resolve())}: {link}: a server on the machine that built it")
                continue
            count += 1
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            there = target.is_file() or (target / "index.html").is_file()
            anchored = not parts.fragment or target not in pages or unquote(parts.fragment) in pages[target].anchors
            if not (there and anchored):
                broken.append(f"{path.relative_to(site.resolve())}: {link}")
    print(
        f"{len(pages)} pages, {count} links within the site, {len(broken)} broken; {len(outside)} others, not asked for"
    )
    print(*broken, sep="\n")
    return 1 if broken or not count else 0


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    sys.exit(main(Path(sys.argv[1])))
